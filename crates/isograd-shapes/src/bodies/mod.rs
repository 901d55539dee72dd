//! The bodies, one file each.

pub(crate) mod airfoil;
pub(crate) mod airliner;
pub(crate) mod car;
pub(crate) mod ellipsoid;
pub(crate) mod fish;
pub(crate) mod knot;
pub(crate) mod nacelle;
pub(crate) mod rounded_box;
pub(crate) mod sphere;
pub(crate) mod torus;
pub(crate) mod vessels;
pub(crate) mod wing;

use crate::kind::Kind;

/// All kinds of bodies, in the order of their list.
pub(crate) static KINDS: [&Kind; 11] = [
    &sphere::KIND,
    &ellipsoid::KIND,
    &torus::KIND,
    &knot::KIND,
    &rounded_box::KIND,
    &fish::FISH,
    &fish::EEL,
    &airliner::KIND,
    &car::KIND,
    &nacelle::KIND,
    &vessels::KIND,
];
