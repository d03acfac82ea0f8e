//! A model that can become an FMU: its dynamics, and the table of its variables.

pub use crate::dynamics::{Dynamics, Instant, StepEnd, StepFailure};
use crate::table::{Scalar, Table};
use crate::variable::Causality;

/// A dynamic system ([`Dynamics`]) with the table of its variables.
pub trait Model: Dynamics {
    /// Returns the table of variables and further contents of the model description.
    fn table() -> &'static Table<Self>;
}

impl<M: Model> Scalar<M> {
    /// Returns the inputs and continuous states on which the value of this variable depends without delay. The element
    /// ModelStructure of the model description lists them.
    pub fn depends_on(&self) -> impl Iterator<Item = &'static Scalar<M>> {
        let known = M::table()
            .scalars
            .iter()
            .filter(|s| s.variable.causality == Causality::Input || s.variable.state.is_some());
        known.filter(|s| self.names(self.variable.depends_on, s))
    }

    /// Returns the inputs and parameters on which the initial value of this variable depends. The element ModelStructure of
    /// the model description lists them.
    pub fn initial_depends_on(&self) -> impl Iterator<Item = &'static Scalar<M>> {
        let known = M::table()
            .scalars
            .iter()
            .filter(|s| matches!(s.variable.causality, Causality::Input | Causality::Parameter));
        known.filter(|s| {
            self.names(self.variable.depends_on, s)
                || self.names(self.variable.initial_depends_on, s)
        })
    }
}
