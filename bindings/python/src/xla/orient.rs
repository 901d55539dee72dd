//! Estimated normals, each on the side of a normal that the caller passes.

use isograd::{Options, Orienter};

use super::Target;
use super::buffers::Call;
use super::common::{Float, cloud, copy};
use crate::backend::Failure;

/// Inputs: points, normals. Output: unit normals. The settings are the options alone.
pub struct Forward;

impl Target for Forward {
    const NAME: &'static str = "isograd_orient";
    #[cfg(feature = "cuda")]
    const HAS_BACKEND: bool = false;

    fn run<T: Float>(mut call: Call<'_>) -> Result<(), Failure> {
        let cloud = cloud(call.vectors::<T>("the points")?, call.normals()?)?;
        let out = call.vectors_out("the normals")?;
        call.check_all_taken()?;
        let options: Options =
            serde_json::from_str(call.settings).map_err(|error| format!("options: {error}"))?;
        let mut plan = Orienter::<T>::new(options.radius, options.orient).with_checks(false);
        let orientation = plan.orient(&cloud).map_err(|error| error.to_string())?;
        copy("the normals", &orientation.normals, out)
    }
}
