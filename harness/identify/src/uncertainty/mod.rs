//! Fourth stage: intervals, and causes of a misfit.

pub mod foresee;
pub mod knowledge;
pub mod likelihood;
pub mod profile;
pub mod solver_error;
pub mod tolerated;
