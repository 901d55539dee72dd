//! `isograd orient`: adds outward normals and their confidence to a cloud.

use std::time::Instant;

use isograd::orient::doubt::Doubt;
use isograd::{Attribute, JsonReport, Orienter, Pipeline, PointCloud, PointCloudError, Real};
use isograd_io::{Attributes, CLOUD_EXTENSIONS, Dtype, Geometry};

use crate::args;
use crate::error::Error;
use crate::outputs::{check_extension, check_not_input, write_report};
use crate::progress::Progress;
use crate::report::{Normals, Report, Times};

/// Runs the command in the number type of the file, or in double precision where single does not hold all its numbers.
///
/// # Errors
/// See [`Error`]; then no file has been left incomplete.
pub fn run(args: &args::OrientCloud) -> Result<(), Error> {
    let start = Instant::now();
    check(args)?;
    let mut progress = Progress::new(3, args.running);
    progress.step("read");
    let uses_normals = args.normals.uses_normals();
    let reading = &args.reading;
    let geometry = reading.read(&args.cloud, Attributes::All, uses_normals)?;
    progress.detail(&format!(
        "{} points, stored as {}",
        geometry.points.len(),
        geometry.dtype.name()
    ));
    let job = Job {
        args,
        start,
        read_seconds: start.elapsed().as_secs_f64(),
    };
    match is_single(&geometry) {
        true => job.run::<f32>(&geometry, &mut progress),
        false => job.run::<f64>(&geometry, &mut progress),
    }
}

fn check(args: &args::OrientCloud) -> Result<(), Error> {
    args.normals.check()?;
    let report = args.report.iter().map(|path| (path, &["json"][..]));
    for (path, endings) in [(&args.output, CLOUD_EXTENSIONS)].into_iter().chain(report) {
        check_extension(path, endings)?;
        check_not_input(path, &args.cloud)?;
        isograd_io::check_output(path, endings)?;
    }
    Ok(())
}

/// Whether single precision holds every number of a file: a time stamp may have more digits than a coordinate.
pub(crate) fn is_single(geometry: &Geometry) -> bool {
    let fits = |&value: &f64| f64::from(value as f32) == value || value.is_nan();
    let mut attributes = geometry.attributes.iter();
    geometry.dtype == Dtype::F32 && attributes.all(|attribute| attribute.values.iter().all(fits))
}

/// A cloud with estimated normals, their confidence, and the attributes of `cloud`.
pub(crate) fn oriented<T: Real>(
    cloud: &PointCloud<T>,
    normals: &[[T; 3]],
    confidence: &[T],
) -> Result<PointCloud<T>, PointCloudError> {
    let confidence = Attribute {
        name: "confidence".into(),
        components: 1,
        values: confidence.to_vec(),
    };
    let attributes = cloud.attributes().iter();
    let attributes = attributes.filter(|attribute| attribute.name != confidence.name);
    let with_normals = PointCloud::new(cloud.points().to_vec())
        .and_then(|cloud| cloud.with_normals(normals.to_vec()));
    std::iter::once(&confidence)
        .chain(attributes)
        .fold(with_normals, |cloud, attribute| {
            cloud?.with_attribute(attribute.clone())
        })
}

/// A run, independent of its number type.
struct Job<'a> {
    args: &'a args::OrientCloud,
    start: Instant,
    read_seconds: f64,
}

impl Job<'_> {
    fn run<T: Pipeline>(&self, geometry: &Geometry, progress: &mut Progress) -> Result<(), Error> {
        let cloud = geometry.cloud::<T>();
        let cloud = cloud.and_then(|cloud| self.args.normals.with_sensors(cloud));
        let cloud = cloud.map_err(Error::input(&self.args.cloud))?;
        progress.step("orient");
        let mut plan = Orienter::new(self.args.normals.radius, self.args.normals.method());
        plan.orient(&cloud)
            .map_err(Error::input(&self.args.cloud))?;
        let (orientation, report) = plan.into_parts();
        progress.warn_of(&report);
        progress.step("write");
        let begin = Instant::now();
        let out = oriented(&cloud, &orientation.normals, &orientation.confidence)
            .map_err(Error::input(&self.args.cloud))?;
        isograd_io::write_cloud(&self.args.output, &out)?;
        progress.print(&format!("wrote {}", self.args.output.display()));
        if let Some(path) = &self.args.report {
            let times = Times {
                read: self.read_seconds,
                write: begin.elapsed().as_secs_f64(),
                total: self.start.elapsed().as_secs_f64(),
            };
            let report = JsonReport::samples(&report);
            let report = Report::new(&self.args.cloud, report, times);
            let normals = Normals::of(geometry, &self.args.normals);
            write_report(path, &report.with_normals(normals))?;
            progress.print(&format!("wrote {}", path.display()));
        }
        progress.finish();
        self.summarize(progress, &report);
        Ok(())
    }

    /// Prints a summary.
    fn summarize(&self, progress: &Progress, report: &isograd::Report) {
        progress.print(&format!(
            "{} points, radius {:.4e} with {} neighbors at the median, {:.2} s",
            report.points,
            report.radius,
            report.neighbors[1],
            self.start.elapsed().as_secs_f64()
        ));
        progress.print(&format!(
            "orientation: {}, {} axes flipped, confidence {:.2} at the median and {:.2} at 5 %",
            report.orientation, report.flipped, report.confidence_median, report.confidence_p05
        ));
        progress.print(&doubtful(&report.doubt));
        progress.conclude(report);
    }
}

/// The share of points with a doubtful side, by reason.
fn doubtful(doubt: &Doubt) -> String {
    let percent = |share: f64| format!("{:.2} %", 100.0 * share);
    let reasons = doubt.by_frequency().into_iter();
    let reasons: Vec<String> = reasons
        .map(|reason| format!("{} {}", reason.name(), percent(doubt.share_of(reason))))
        .collect();
    let reasons = match reasons.is_empty() {
        true => String::new(),
        false => format!(" ({})", reasons.join(", ")),
    };
    format!(
        "doubtful: {} of the points{reasons}",
        percent(doubt.share())
    )
}
