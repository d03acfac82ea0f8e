//! Progress of a method.

/// A line of news.
#[derive(Clone, Debug)]
pub enum News {
    /// A step of the way.
    Step(String),
    /// Details: the attempts of a search.
    Detail(String),
}

impl News {
    /// The line.
    pub fn line(&self) -> &str {
        let (News::Step(line) | News::Detail(line)) = self;
        line
    }
}
