#[derive(Clone, Debug)]
pub enum News {
    Step(String),
    Detail(String),
}

impl News {
    pub fn line(&self) -> &str {
        let (News::Step(line) | News::Detail(line)) = self;
        line
    }
}
