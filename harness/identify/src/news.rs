//! What is told while a method works.

/// A line of news.
#[derive(Clone, Debug)]
pub enum News {
    /// A step of the way.
    Step(String),
    /// How it is gone: the attempts of a search.
    Detail(String),
}

impl News {
    /// The line.
    pub fn line(&self) -> &str {
        let (News::Step(line) | News::Detail(line)) = self;
        line
    }
}
