//! Names of elements and items, and the sentences about runs that leave the range of the model.

mod limits;
mod names;
