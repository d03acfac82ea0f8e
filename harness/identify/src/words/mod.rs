//! Fifth stage of an identification: the results in words, as a page and as JSON.

pub mod combination;
pub mod identified;
pub mod page;
pub mod verdict;
