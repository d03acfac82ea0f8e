//! Which messages go to the host's logger.
//!
//! Only calls that fail are worth a message; a host that asks for everything
//! gets no chatter. `loggingOn` of fmi2Instantiate switches *debug* messages, of
//! which there are none: failures are reported either way, because a status
//! without a reason helps nobody. fmi2SetDebugLogging is an explicit wish and is
//! obeyed: off means silence.

use crate::calls::Severity;

/// A log category of the model description.
#[derive(Debug)]
pub struct Category {
    /// As hosts name it.
    pub name: &'static str,
    /// What it holds.
    pub description: &'static str,
    /// The failure it is for; `None` stands for all of them.
    pub severity: Option<Severity>,
}

/// All categories there are.
pub const CATEGORIES: [Category; 4] = [
    Category {
        name: "logStatusDiscard",
        description: "Why a call returned fmi2Discard",
        severity: Some(Severity::Discard),
    },
    Category {
        name: "logStatusError",
        description: "Why a call returned fmi2Error",
        severity: Some(Severity::Error),
    },
    Category {
        name: "logStatusFatal",
        description: "Why a call returned fmi2Fatal",
        severity: Some(Severity::Fatal),
    },
    Category { name: "logAll", description: "All of the above", severity: None },
];

/// The category of messages of this severity.
pub fn category(severity: Severity) -> &'static str {
    CATEGORIES.iter().find(|c| c.severity == Some(severity)).map_or("logAll", |c| c.name)
}

/// What one instance logs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filter {
    discard: bool,
    error: bool,
    fatal: bool,
}

impl Filter {
    /// Everything; this is how an instance starts.
    pub const ALL: Filter = Filter { discard: true, error: true, fatal: true };
    /// Silence.
    pub const NONE: Filter = Filter { discard: false, error: false, fatal: false };

    /// Only these categories; none given means all. Unknown names are an error
    /// that lists them and the known ones.
    pub fn of(names: &[String]) -> Result<Filter, String> {
        if names.is_empty() {
            return Ok(Filter::ALL);
        }
        let mut filter = Filter::NONE;
        let mut unknown = Vec::new();
        for name in names {
            match CATEGORIES.iter().find(|c| c.name == name) {
                Some(Category { severity: None, .. }) => filter = Filter::ALL,
                Some(Category { severity: Some(Severity::Discard), .. }) => filter.discard = true,
                Some(Category { severity: Some(Severity::Error), .. }) => filter.error = true,
                Some(Category { severity: Some(Severity::Fatal), .. }) => filter.fatal = true,
                None => unknown.push(format!("\"{name}\"")),
            }
        }
        if unknown.is_empty() {
            return Ok(filter);
        }
        let known: Vec<_> = CATEGORIES.iter().map(|c| c.name).collect();
        Err(format!("unknown log category {}; known: {}", unknown.join(", "), known.join(", ")))
    }

    /// Whether messages of this severity are wanted.
    pub fn wants(&self, severity: Severity) -> bool {
        match severity {
            Severity::Discard => self.discard,
            Severity::Error => self.error,
            Severity::Fatal => self.fatal,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_category_means_all() {
        assert_eq!(Filter::of(&[]), Ok(Filter::ALL));
    }

    #[test]
    fn only_the_categories_asked_for_are_wanted() {
        let filter = Filter::of(&["logStatusFatal".into()]).unwrap();
        assert!(filter.wants(Severity::Fatal));
        assert!(!filter.wants(Severity::Error));
    }

    #[test]
    fn unknown_category_is_named_with_the_known_ones() {
        let message = Filter::of(&["logStatusEror".into()]).unwrap_err();
        assert!(message.contains("logStatusEror") && message.contains("logStatusError"));
    }

    #[test]
    fn every_severity_has_its_category() {
        assert_eq!(category(Severity::Discard), "logStatusDiscard");
        assert_eq!(category(Severity::Error), "logStatusError");
        assert_eq!(category(Severity::Fatal), "logStatusFatal");
    }
}
