//! Progress of a method.

#[derive(Clone, Debug)]
pub enum News {
    /// A step of the method.
    Step(String),
    /// Details: the attempts of a search.
    Detail(String),
}

impl News {
    pub fn line(&self) -> &str {
        let (News::Step(line) | News::Detail(line)) = self;
        line
    }
}
