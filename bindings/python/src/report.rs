//! The report as a dictionary, with the names of the command line's `report.json`.

use isograd::differential::Spread;
use isograd::orient::doubt::{Doubt, Reason};
use isograd::{Report, Stage};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The report; see `isograd.Reconstruction.report`.
pub fn dict<'py>(py: Python<'py>, backend: &str, report: &Report) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("backend", backend)?;
    dict.set_item("points", report.points)?;
    dict.set_item("normals", normals(py, report)?)?;
    dict.set_item("orientation", orientation(py, report)?)?;
    dict.set_item("smoothing", report.smoothing)?;
    dict.set_item("iso_value", report.iso_value)?;
    dict.set_item("surface", surface(py, report)?)?;
    dict.set_item("sdf", sdf(py, report)?)?;
    dict.set_item("seconds", seconds(py, report)?)?;
    dict.set_item("warnings", warnings(report))?;
    Ok(dict)
}

/// The part of it that a cloud has without a grid; see `isograd.Oriented.report`.
pub fn of_samples<'py>(py: Python<'py>, report: &Report) -> PyResult<Bound<'py, PyDict>> {
    let (dict, seconds) = (PyDict::new(py), PyDict::new(py));
    for stage in [Stage::Normals, Stage::Orient, Stage::Checks] {
        seconds.set_item(stage.name(), report.seconds.of(stage))?;
    }
    seconds.set_item("total", report.seconds.total())?;
    dict.set_item("points", report.points)?;
    dict.set_item("normals", normals(py, report)?)?;
    dict.set_item("orientation", orientation(py, report)?)?;
    dict.set_item("seconds", seconds)?;
    dict.set_item("warnings", warnings(report))?;
    Ok(dict)
}

fn warnings(report: &Report) -> Vec<String> {
    report.warnings.iter().map(ToString::to_string).collect()
}

fn normals<'py>(py: Python<'py>, report: &Report) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let neighbors = PyDict::new(py);
    for (name, n) in ["min", "median", "max"].into_iter().zip(report.neighbors) {
        neighbors.set_item(name, n)?;
    }
    dict.set_item("radius", report.radius)?;
    dict.set_item("sample_spacing", report.sample_spacing)?;
    dict.set_item("neighbours", neighbors)?;
    dict.set_item("guarded", report.guarded)?;
    Ok(dict)
}

fn orientation<'py>(py: Python<'py>, report: &Report) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let confidence = PyDict::new(py);
    confidence.set_item("p05", report.confidence_p05)?;
    confidence.set_item("median", report.confidence_median)?;
    dict.set_item("method", report.orientation)?;
    dict.set_item("flipped", report.flipped)?;
    dict.set_item("confidence", confidence)?;
    dict.set_item("doubtful", doubtful(py, &report.doubt)?)?;
    Ok(dict)
}

/// Shares of the points that are doubtful: all, and by reason.
fn doubtful<'py>(py: Python<'py>, doubt: &Doubt) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("share", doubt.share())?;
    for reason in Reason::ALL {
        dict.set_item(reason.name(), doubt.share_of(reason))?;
    }
    Ok(dict)
}

fn surface<'py>(py: Python<'py>, report: &Report) -> PyResult<Bound<'py, PyDict>> {
    let (dict, of) = (PyDict::new(py), &report.surface);
    dict.set_item("vertices", of.vertices)?;
    dict.set_item("faces", of.faces)?;
    dict.set_item("components", of.components)?;
    dict.set_item("area", of.area)?;
    dict.set_item("volume", of.volume)?;
    dict.set_item("euler", of.euler)?;
    dict.set_item("closed", of.closed)?;
    Ok(dict)
}

fn sdf<'py>(py: Python<'py>, report: &Report) -> PyResult<Bound<'py, PyDict>> {
    let (dict, eikonal) = (PyDict::new(py), PyDict::new(py));
    dict.set_item("min", report.sdf_min)?;
    dict.set_item("max", report.sdf_max)?;
    for (name, spread) in [("all", &report.eikonal.all), ("near", &report.eikonal.near)] {
        let spread = spread.as_ref().map(|of| statistics(py, of)).transpose()?;
        eikonal.set_item(name, spread)?;
    }
    dict.set_item("eikonal", eikonal)?;
    Ok(dict)
}

fn statistics<'py>(py: Python<'py>, of: &Spread) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("mean", of.mean)?;
    dict.set_item("p05", of.p05)?;
    dict.set_item("p95", of.p95)?;
    Ok(dict)
}

fn seconds<'py>(py: Python<'py>, report: &Report) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for stage in Stage::ALL {
        dict.set_item(stage.name(), report.seconds.of(stage))?;
    }
    dict.set_item("total", report.seconds.total())?;
    Ok(dict)
}
