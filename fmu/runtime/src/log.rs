//! Selection of the messages that are passed to the host's logger.
//!
//! There are messages about calls that fail, warnings at the start of the simulation and when an array size changes, and messages
//! about events of the model. `loggingOn` of a new instance has no effect: failures are always logged, because a status without a
//! reason is useless, and events are logged only if the host switches a log category on. fmi2SetDebugLogging and
//! fmi3SetDebugLogging do have an effect: off means no messages, and on without categories means all messages.

use crate::call::Severity;
use crate::model::Model;
use crate::table::Table;
use crate::version::Version;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Topic {
    Event,
    /// A parameter, input or state is outside the range in which the model was verified.
    Warning,
    Failure(Severity),
}

/// A log category of the model description, which the host can switch on and off.
#[derive(Clone, Debug)]
#[allow(missing_docs)]
pub struct Category {
    pub name: &'static str,
    pub description: String,
    /// Topic of the messages in this category; `None` for a category that contains all topics.
    pub topic: Option<Topic>,
}

const NAMES: [(&str, Option<Topic>); 6] = [
    ("logEvents", Some(Topic::Event)),
    ("logStatusWarning", Some(Topic::Warning)),
    ("logStatusDiscard", Some(Topic::Failure(Severity::Discard))),
    ("logStatusError", Some(Topic::Failure(Severity::Error))),
    ("logStatusFatal", Some(Topic::Failure(Severity::Fatal))),
    ("logAll", None),
];

fn category_names<M: Model>(table: &Table<M>) -> &'static [(&'static str, Option<Topic>)] {
    if table.about.events.is_empty() { &NAMES[1..] } else { &NAMES }
}

/// Returns the log categories of the model to which `table` belongs, with descriptions for the FMI version `V`.
pub fn categories<M: Model, V: Version>(table: &Table<M>) -> Vec<Category> {
    let description = |topic| match topic {
        Some(Topic::Event) => table.about.events.into(),
        Some(Topic::Warning) => {
            "Warnings about parameters and inputs, such as values for which the model is not valid"
                .into()
        }
        Some(Topic::Failure(severity)) => {
            format!("Why a call returned {}{severity:?}", V::PREFIX)
        }
        None => "All of the above".into(),
    };
    let all = category_names(table).iter();
    all.map(|&(name, topic)| Category { name, description: description(topic), topic }).collect()
}

/// Returns the name of the log category to which messages on a topic belong.
pub fn category(topic: Topic) -> &'static str {
    NAMES.iter().find(|(_, of)| *of == Some(topic)).map_or("logAll", |(name, _)| name)
}

/// The messages of one instance that are passed to the host's log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filter {
    events: bool,
    warning: bool,
    discard: bool,
    error: bool,
    fatal: bool,
}

#[allow(missing_docs)]
impl Filter {
    /// Failures and warnings but no events. A new instance starts with this selection.
    pub const FAILURES: Filter =
        Filter { events: false, warning: true, discard: true, error: true, fatal: true };
    pub const ALL: Filter = Filter { events: true, ..Filter::FAILURES };
    pub const NONE: Filter =
        Filter { events: false, warning: false, discard: false, error: false, fatal: false };

    /// The reasons of failed calls, without warnings and events.
    pub const ERRORS: Filter = Filter { warning: false, ..Filter::FAILURES };

    pub fn with_errors(self) -> Filter {
        Filter { discard: true, error: true, fatal: true, ..self }
    }

    /// Returns the selection of messages in the log categories `names`. An empty list selects all messages.
    ///
    /// # Errors
    /// If a category is unknown; the text lists the unknown and the known categories.
    pub fn from_categories<M: Model>(names: &[String], table: &Table<M>) -> Result<Filter, String> {
        let known = category_names(table);
        if names.is_empty() {
            return Ok(Filter::ALL);
        }
        let mut filter = Filter::NONE;
        let mut unknown = Vec::new();
        for name in names {
            match known.iter().find(|(known, _)| known == name).map(|(_, topic)| *topic) {
                Some(None) => filter = Filter::ALL,
                Some(Some(topic)) => *filter.switch(topic) = true,
                None => unknown.push(format!("\"{name}\"")),
            }
        }
        if unknown.is_empty() {
            return Ok(filter);
        }
        let known: Vec<_> = known.iter().map(|(name, _)| *name).collect();
        Err(format!("unknown log category {}; known: {}", unknown.join(", "), known.join(", ")))
    }

    pub fn wants(mut self, topic: Topic) -> bool {
        *self.switch(topic)
    }

    fn switch(&mut self, topic: Topic) -> &mut bool {
        match topic {
            Topic::Event => &mut self.events,
            Topic::Warning => &mut self.warning,
            Topic::Failure(Severity::Discard) => &mut self.discard,
            Topic::Failure(Severity::Error) => &mut self.error,
            Topic::Failure(Severity::Fatal) => &mut self.fatal,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Model;
    use crate::spring::Spring;

    fn spring_filter(names: &[String]) -> Result<Filter, String> {
        Filter::from_categories(names, Spring::table())
    }

    #[test]
    fn an_empty_list_of_log_categories_means_all() {
        assert_eq!(spring_filter(&[]), Ok(Filter::ALL));
    }

    #[test]
    fn only_requested_log_categories_are_logged() {
        let filter = spring_filter(&["logStatusFatal".into()]).unwrap();
        assert!(filter.wants(Topic::Failure(Severity::Fatal)));
        assert!(!filter.wants(Topic::Failure(Severity::Error)));
        assert!(!filter.wants(Topic::Event));
    }

    #[test]
    fn errors_are_logged_even_if_no_category_is_requested() {
        assert_eq!(Filter::NONE.with_errors(), Filter::ERRORS);
        assert_eq!(Filter::ALL.with_errors(), Filter::ALL);
        let events = Filter { events: true, ..Filter::NONE }.with_errors();
        assert!(events.wants(Topic::Event) && !events.wants(Topic::Warning));
    }

    #[test]
    fn events_are_logged_only_on_request() {
        assert!(!Filter::FAILURES.wants(Topic::Event));
    }

    #[test]
    fn the_error_about_an_unknown_log_category_lists_the_known_categories() {
        let message = spring_filter(&["logStatusEror".into()]).unwrap_err();
        assert!(message.contains("logStatusEror") && message.contains("logStatusError"));
    }

    #[test]
    fn every_kind_of_log_message_has_a_log_category() {
        assert_eq!(category(Topic::Event), "logEvents");
        assert_eq!(category(Topic::Warning), "logStatusWarning");
        assert_eq!(category(Topic::Failure(Severity::Discard)), "logStatusDiscard");
        assert_eq!(category(Topic::Failure(Severity::Error)), "logStatusError");
        assert_eq!(category(Topic::Failure(Severity::Fatal)), "logStatusFatal");
    }
}
