//! The hierarchy of boxes over triangles, and the closest triangle in it.

mod build;
mod list;
mod morton;
mod search;
mod settle;
mod single;

pub(super) use build::{NONE, Tree};
pub(super) use search::{cells, center};
