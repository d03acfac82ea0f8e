/// Returns the items of a comma-separated list. A comma in brackets does not separate items:
/// `a,inertia[1,2]` has two items.
pub fn list(text: &str) -> impl Iterator<Item = &str> {
    let mut depth = 0i32;
    let items = text.split(move |c| {
        depth += i32::from(matches!(c, '[' | '(')) - i32::from(matches!(c, ']' | ')'));
        c == ',' && depth == 0
    });
    items.map(str::trim).filter(|item| !item.is_empty())
}
