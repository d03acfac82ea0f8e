//! Writes the results of an identification: sentences of the verdict, an HTML page and JSON.

pub mod identified;
pub mod page;
pub mod verdict;
