//! Columns of text files: recognized, chosen, or refused, and never guessed against a header.

use isograd_io::{Format, Geometry, parse_geometry};

use crate::files::source;

fn read(text: &str) -> Result<Geometry, String> {
    parse_geometry(&source("file.csv", text), Format::Text).map_err(|e| e.to_string())
}

const POINT: [f64; 3] = [1.0, 2.0, 3.0];

#[test]
fn usual_names_of_coordinates_are_recognized() {
    for header in [
        "t,x,y,z",
        "t,X,Y,Z",
        "t,x [m],y [m],z [m]",
        "t,x(m),y(m),z(m)",
        "t, X , Y , Z ",
        "t,\"x\",\"y\",\"z\"",
        "t,\"x, m [m]\",y,z".replace("x, m ", "x ").as_str(),
        "t,Points:0,Points:1,Points:2",
        "\"t\",\"Points:0\",\"Points:1\",\"Points:2\"",
        "t,Points_0,Points_1,Points_2",
        "t,points_x,points_y,points_z",
        "t,Position.x,Position.y,Position.z",
        "t,pos_x,pos_y,pos_z",
        "t,easting,northing,height",
        "t,Easting [m],Northing [m],Elevation [m]",
        "t,x,y,height,z".replace("height,", "").as_str(),
    ] {
        let file = read(&format!("{header}\n9,1,2,3\n9,1,2,3\n"));
        let file = file.unwrap_or_else(|e| panic!("{header}: {e}"));
        assert_eq!(file.points, [POINT; 2], "{header}");
        assert_eq!(file.attributes.len(), 1, "{header}");
        assert_eq!(file.attributes[0].name, "t", "{header}");
    }
    for text in [
        "t\tx [m]\ty [m]\tz [m]\n9\t1\t2\t3\n",
        "t x [m] y [m] z [m]\n9 1 2 3\n",
        "# t x [m] y [m] z [m]\n9 1 2 3\n",
        "//t,X,Y,Z\n9 1 2 3\n",
        "t;\"x\";\"y\";\"z\"\n9;1;2;3\n",
        "z,t,x,y\n3,9,1,2\n",
    ] {
        let file = read(text).unwrap_or_else(|e| panic!("{text}: {e}"));
        assert_eq!(file.points, [POINT], "{text}");
    }
}

#[test]
fn usual_names_of_normals_are_recognized() {
    for header in [
        "nx,ny,nz,x,y,z",
        "NX,NY,NZ,X,Y,Z",
        "nx [],ny [],nz [],x [m],y [m],z [m]",
        "Normals:0,Normals:1,Normals:2,Points:0,Points:1,Points:2",
        "\"Normals_0\",\"Normals_1\",\"Normals_2\",\"Points_0\",\"Points_1\",\"Points_2\"",
        "normal_x,normal_y,normal_z,x,y,z",
        "n_x,n_y,n_z,x,y,z",
    ] {
        let file = read(&format!("{header}\n0,0,1,1,2,3\n"));
        let file = file.unwrap_or_else(|e| panic!("{header}: {e}"));
        assert_eq!(file.points, [POINT], "{header}");
        assert_eq!(file.normals, Some(vec![[0.0, 0.0, 1.0]]), "{header}");
        assert!(file.attributes.is_empty(), "{header}");
    }
}

#[test]
fn a_header_without_coordinates_is_refused_and_lists_its_columns() {
    for header in [
        "a,b,c",
        "t,a,b,c",
        "# t,lon,lat,depth",
        "Normals:0,Normals:1,Normals:2,Other",
        "x,y,w,t",
        "x [m],x [ft],y,z",
    ] {
        let row = vec!["0.5"; header.split(',').count()].join(",");
        let message = read(&format!("{header}\n{row}\n")).expect_err(header);
        for name in header.trim_start_matches("# ").split(',') {
            assert!(message.contains(&format!("'{name}'")), "{message}");
        }
        assert!(message.contains("--columns A,B,C"), "{message}");
        assert!(message.contains("file.csv, line 1"), "{message}");
    }
}

#[test]
fn decimal_commas_are_named() {
    for text in [
        "1,5;2,5;3,5\n",
        "x;y;z\n1,5;2;3\n",
        "1,5 2,5 3,5\n",
        "1,5\t2,5\t3,5\n",
        "x y z\n1 2 3\n1,5 2 3\n",
        "\"1,5\",\"2,5\",\"3,5\"\n",
        "x,y,z\n1,5,2,5,3,5\n",
        "x\ty\tz\n-1,5e-3\t2\t3\n",
    ] {
        let message = read(text).expect_err(text);
        assert!(message.contains("decimal comma"), "{text:?}: {message}");
    }
}

#[test]
fn quoted_numbers_and_an_index_without_a_name_are_read() {
    for text in [
        "\"1\",\"2\",\"3\"\n\"1.0\",\"2e0\",\" 3 \"\n",
        "x,y,z\n\"1\",\"2\",\"3\"\n1,2,3\n",
        ",x,y,z\n0,1,2,3\n1,1,2,3\n",
        "\"\",\"x\",\"y\",\"z\"\n0,1,2,3\n1,1,2,3\n",
        ";x;y;z\n0;1;2;3\n1;1;2;3\n",
    ] {
        let file = read(text).unwrap_or_else(|e| panic!("{text}: {e}"));
        assert_eq!(file.points, [POINT; 2], "{text}");
        assert!(file.attributes.is_empty(), "{text}");
    }
}

#[test]
fn lines_may_end_in_carriage_returns_alone() {
    let same = |format: Format, text: &str| {
        let read = |text: String| parse_geometry(&source("file", text), format).expect("valid");
        let expected = read(text.into());
        for end in ["\r", "\r\n"] {
            assert_eq!(read(text.replace('\n', end)), expected, "{text}");
        }
    };
    same(Format::Text, "# comment\nx,y,z\n1,2,3\n\n4,5,6\n");
    same(Format::Text, "1 2 3\n4 5 6");
    same(Format::Obj, crate::files::OBJ);
    same(Format::Stl, crate::files::ASCII_STL);
    same(Format::Ply, crate::files::ASCII_PLY);
    // The first byte of the data behind a lone carriage return may be that of a line end.
    let mut bytes = b"ply\rformat binary_little_endian 1.0\relement vertex 1\rproperty uchar x\rproperty uchar y\rproperty uchar z\rend_header\r".to_vec();
    bytes.extend([b'\n', 2, 3]);
    let file = parse_geometry(&source("file", bytes), Format::Ply).expect("valid");
    assert_eq!(file.points, [[10.0, 2.0, 3.0]]);
    let error = parse_geometry(&source("file", "1 2 3\r4 5 6\r7 8\r"), Format::Text);
    let message = error.expect_err("short").to_string();
    assert!(message.contains("line 3"), "{message}");
}
