//! The extension module `isograd._core`. Users see it through the package `isograd`, which is in `python/`.

mod arrays;
mod backend;
mod background;
mod clean;
mod command;
mod errors;
mod files;
mod fit;
mod grid;
mod isosurface;
mod orient;
mod plan;
mod pool;
mod query;
mod result;
mod sdf_grid;
mod settings;
mod shape;
mod threads;
mod xla;

use pyo3::prelude::*;

#[pymodule(gil_used = false)]
mod _core {
    use super::*;

    #[pymodule_export]
    use clean::clean_points;
    #[pymodule_export]
    use command::run_command;
    #[pymodule_export]
    use files::{read_field, read_geometry, write_bytes, write_field, write_mesh, write_points};
    #[pymodule_export]
    use fit::run_fit;
    #[pymodule_export]
    use grid::{check_grid, fit_grid};
    #[pymodule_export]
    use isosurface::{Isosurface, extract_surface};
    #[pymodule_export]
    use orient::orient;
    #[pymodule_export]
    use plan::Plan;
    #[pymodule_export]
    use pool::open_backend;
    #[pymodule_export]
    use query::{query_mesh, query_mesh_pullback};
    #[pymodule_export]
    use result::{Extension, ReconstructionArrays};
    #[pymodule_export]
    use sdf_grid::{sdf_of_mesh, sdf_of_mesh_pullback};
    #[pymodule_export]
    use shape::{Shape, shapes};
    #[pymodule_export]
    use threads::{get_num_threads, set_num_threads};
    #[cfg(feature = "cuda")]
    #[pymodule_export]
    use xla::call_target_on_cuda;
    #[pymodule_export]
    use xla::{call_target, xla_targets};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
