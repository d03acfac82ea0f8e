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

/// Adds to lines what was simulated since the line before.
#[derive(Debug, Default)]
pub struct Since(f64);

impl Since {
    /// The line, with what makes `simulations` of those before.
    pub fn line(&mut self, line: String, simulations: f64) -> String {
        let more = simulations - std::mem::replace(&mut self.0, simulations);
        if more == 0.0 { line } else { format!("{line} ({more:.1} simulations)") }
    }
}
