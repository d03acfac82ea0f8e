//! Comparison of the thesis's statements about its bench and synthetic data with the campaign's runs.
//!
//! The thesis prints few numbers; its statements are quoted in our words, each with a rule that
//! decides from the runs whether a model does the same. A number in a statement is a number in its
//! rule. Every model of the plan is held against every statement that its runs can answer; a rule
//! must hold for every fill, and for every torque that the statement covers. The thesis's synthetic
//! data have a linear liquid. The list is complete for chapters 7 and 8 and appendix A: what no rule can
//! judge is in it with the reason.

mod statements;

use experiments::plan::RECORDING;
use maud::{Markup, html};

use self::statements::STATEMENTS;
use super::page::{Group, cm, distinct};

/// Findings for each fill, and true if the statement holds for all of them; `None` if runs are missing.
type Cell = Option<(Vec<String>, bool)>;

/// Source of a statement in the thesis.
#[derive(Clone, Copy, PartialEq)]
enum Who {
    /// The bench, whose liquid is water.
    Bench,
    /// The synthetic data, whose liquid is linear.
    Synthetic,
    /// A calculation, without a model of the liquid.
    Thesis,
}

impl Who {
    fn name(self) -> &'static str {
        match self {
            Who::Bench => "bench",
            Who::Synthetic => "synthetic data",
            Who::Thesis => "calculation",
        }
    }
}

/// Figures of a group of runs for one statement, and true if the statement holds.
type Shown = (String, bool);

/// Rule that decides on a statement. It returns `None` where the runs it needs are not there.
#[derive(Clone, Copy)]
enum Judge {
    /// A rule for each fill.
    Fill(fn(&Group) -> Option<Shown>),
    /// A rule for all fills of a model together.
    Fills(fn(&[&Group]) -> Option<Shown>),
    /// A rule without runs.
    Number(fn() -> Shown),
    /// None: the remark has the reason.
    Not,
}

#[derive(Clone, Copy)]
struct Statement {
    section: &'static str,
    who: Who,
    /// The thesis's statement in our words.
    says: &'static str,
    /// The rule, for the reader.
    rule: &'static str,
    judge: Judge,
    /// Known reason for a difference, or for the lack of a rule.
    why: &'static str,
    /// Reason for which a model that passes does not support the statement.
    despite: &'static str,
}

/// The table; empty where the plan has none of the runs it needs.
pub(super) fn statements(groups: &[Group]) -> Markup {
    let Judged { models, rows } = judged(groups);
    if rows.is_empty() {
        return html! {};
    }
    let recorded = models.iter().position(|model| *model == RECORDING);
    // the others are in the ledger
    let answers = |(_, cells): &&(&Statement, Vec<Cell>)| cells.iter().any(Option::is_some);
    html! {
        p {
            "What Rubaga's thesis says of its bench and of its synthetic data, in our words, and what these runs do. "
    "Statements on the bench that a model's runs agree with, and statements on the synthetic data: "
            @for (i, model) in models.iter().enumerate() {
                @if i > 0 { "; " }
                (model) " " (tally(&rows, i, Who::Bench)) ", " (tally(&rows, i, Who::Synthetic))
            }
            @if let Some(place) = recorded {
                ". Comparison with the recording: statements on the bench for which a model agrees with the recording, independent of the thesis (=; else ≠): "
                @for (k, (i, model)) in models.iter().enumerate().filter(|(i, _)| *i != place).enumerate() {
                    @if k > 0 { "; " }
                    (model) " " (alike(&rows, i, place))
                }
            }
            ". ✓ and ✗ say whether a model does what the statement says, at every fill. The synthetic data have a linear liquid. The thesis prints its features as figures only; where it names a number, the rule holds the model to it. ledger.md lists the statements that these runs do not answer. Off-axis rates (7.1.5, first half) are not here: the hub of the FMU does not tilt."
        }
        div .wide {
            table .statements {
                thead {
                    tr {
                        th { "what the thesis says" }
                        @for model in &models { th { (model) } }
                    }
                }
                tbody {
                    @for (statement, cells) in rows.iter().filter(answers) {
                        tr {
                            td {
                                (statement.says)
                                span .note {
                                    "Thesis " (statement.section) ", " (statement.who.name()) "."
                                }
                                span .note { (statement.decides()) "." }
                                @for remark in statement.remarks(cells) { span .note { (plain(&remark)) } }
                            }
                            @let there = recorded.and_then(|place| cells[place].as_ref()).map(|cell| cell.1);
                            @for (i, cell) in cells.iter().enumerate() {
                                td {
                                    @if let Some((each, holds)) = cell {
                                        @if let Some(there) = there.filter(|_| statement.who == Who::Bench && recorded != Some(i)) {
                                            @if there == *holds { span .yes { "= " } } @else { span .no { "≠ " } }
                                        }
                                        @if *holds { span .yes { "✓ " } } @else { span .no { "✗ " } }
                                        @for (i, text) in each.iter().enumerate() {
                                            @if i > 0 { br; "\u{2003}" }
                                            (text)
                                        }
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Number of statements of a source that a model agrees with, of those that it can answer: "12 of 20".
fn tally(rows: &[(&Statement, Vec<Cell>)], model: usize, who: Who) -> String {
    let [passed, failed] = count(rows, model, who);
    format!("{passed} of {}", passed + failed)
}

/// Numbers of statements of a source that a model passes and fails.
fn count(rows: &[(&Statement, Vec<Cell>)], model: usize, who: Who) -> [usize; 2] {
    let cells = rows.iter().filter(|(statement, _)| statement.who == who);
    let verdicts: Vec<bool> =
        cells.filter_map(|(_, cells)| Some(cells[model].as_ref()?.1)).collect();
    let passed = verdicts.iter().filter(|holds| **holds).count();
    [passed, verdicts.len() - passed]
}

/// Number of statements on the bench in which a model does what the recording does.
fn alike(rows: &[(&Statement, Vec<Cell>)], model: usize, recorded: usize) -> String {
    let bench = rows.iter().filter(|(statement, _)| statement.who == Who::Bench);
    let pairs: Vec<bool> = bench
        .filter_map(|(_, cells)| Some(cells[model].as_ref()?.1 == cells[recorded].as_ref()?.1))
        .collect();
    format!("{} of {}", pairs.iter().filter(|same| **same).count(), pairs.len())
}

/// Models and, for each statement, their verdicts.
struct Judged<'a> {
    models: Vec<&'a str>,
    rows: Vec<(&'static Statement, Vec<Cell>)>,
}

/// Applies every rule; no rows if the plan has none of the runs they need.
fn judged<'a>(groups: &'a [Group]) -> Judged<'a> {
    let groups: Vec<&Group> = groups.iter().filter(|group| group.others.is_empty()).collect();
    let models = distinct(groups.iter().map(|group| group.model));
    let of = |statement: &Statement, model: &str| {
        let same: Vec<&Group> = groups.iter().copied().filter(|g| g.model == model).collect();
        shown(statement, &same)
    };
    let mut rows: Vec<(&Statement, Vec<Cell>)> = STATEMENTS
        .iter()
        .map(|statement| (statement, models.iter().map(|model| of(statement, model)).collect()))
        .collect();
    let answers = |(statement, cells): &(&Statement, Vec<Cell>)| {
        statement.who != Who::Thesis && cells.iter().any(Option::is_some)
    };
    if !rows.iter().any(answers) {
        rows.clear();
    }
    // in the order of the thesis; a statement of several sections stands in the first
    rows.sort_by_key(|(statement, _)| statement.section.split([',', ' ']).next());
    Judged { models, rows }
}

impl Statement {
    /// The rule, or its lack.
    fn decides(&self) -> String {
        match self.judge {
            Judge::Not => "Not judged".into(),
            _ => format!("Rule: {}", self.rule),
        }
    }

    /// The remarks that these verdicts call for.
    fn remarks(&self, cells: &[Cell]) -> Vec<String> {
        let any = |verdict: bool| cells.iter().flatten().any(|(_, holds)| *holds == verdict);
        let mut remarks = Vec::new();
        if !self.why.is_empty() && (any(false) || matches!(self.judge, Judge::Not)) {
            remarks.push(self.why.to_string());
        }
        if !self.despite.is_empty() && any(true) {
            remarks.push(format!("Passes for another reason: {}", self.despite));
        }
        remarks
    }
}

/// A remark without its links, whose targets are pages of the book.
fn plain(remark: &str) -> String {
    let link = remark.split_once("](");
    let link = link.and_then(|(a, b)| Some((a.rsplit_once('[')?, b.split_once(')')?)));
    match link {
        Some(((before, name), (_, after))) => format!("{before}{name}{}", plain(after)),
        None => remark.into(),
    }
}

/// Returns the ledger of the thesis's statements as Markdown: counts, and a table with the verdicts. Empty where the plan
/// has none of the runs it needs.
pub(super) fn ledger(groups: &[Group]) -> String {
    let Judged { models, rows } = judged(groups);
    if rows.is_empty() {
        return String::new();
    }
    let unjudged = rows.iter().filter(|(statement, _)| matches!(statement.judge, Judge::Not));
    let mut text = format!(
        "{} statements, {} of them not judged. Passed of those judged:\n\n| | {} |\n| --- |{}\n",
        rows.len(),
        unjudged.count(),
        models.join(" | "),
        " --- |".repeat(models.len())
    );
    for who in [Who::Bench, Who::Synthetic, Who::Thesis] {
        let tallies: Vec<String> = (0..models.len()).map(|i| tally(&rows, i, who)).collect();
        text += &format!("| {} | {} |\n", who.name(), tallies.join(" | "));
    }
    let other = |i: usize| {
        let passes = |cells: &[Cell]| cells[i].as_ref().is_some_and(|cell| cell.1);
        rows.iter().filter(|(s, cells)| !s.despite.is_empty() && passes(cells)).count().to_string()
    };
    let others: Vec<String> = (0..models.len()).map(other).collect();
    text += &format!("| passed for another reason | {} |\n", others.join(" | "));
    text += &format!(
        "\n| section | of the | statement | {} | rule and remarks |\n| --- | --- | --- |{} --- |\n",
        models.join(" | "),
        " --- |".repeat(models.len())
    );
    for (statement, cells) in &rows {
        let mark = |cell: &Cell| match cell {
            Some((_, true)) if !statement.despite.is_empty() => "(✓)",
            Some((_, true)) => "✓",
            Some((_, false)) => "✗",
            None => "–",
        };
        let marks: Vec<&str> = cells.iter().map(mark).collect();
        let remarks = statement.remarks(cells).into_iter();
        let cell: Vec<String> =
            [format!("{}.", statement.decides())].into_iter().chain(remarks).collect();
        text += &format!(
            "| {} | {} | {} | {} | {} |\n",
            statement.section,
            statement.who.name(),
            statement.says,
            marks.join(" | "),
            cell.join(" ").replace('|', "\\|")
        );
    }
    text
}

/// Combines the groups of a model: the statement holds if it holds for every fill.
/// `None` without groups, or if one lacks the runs.
fn shown(statement: &Statement, groups: &[&Group]) -> Cell {
    let signs = |text: String| text.replace('-', "\u{2212}");
    let each: Vec<Shown> = match statement.judge {
        Judge::Not => return None,
        Judge::Number(rule) => {
            let (text, holds) = rule();
            return Some((vec![signs(text)], holds));
        }
        Judge::Fills(rule) => {
            let (text, holds) = rule(groups)?;
            return Some((vec![signs(text)], holds));
        }
        Judge::Fill(rule) => groups.iter().map(|group| rule(group)).collect::<Option<_>>()?,
    };
    let text = groups.iter().zip(&each).map(|(group, (text, _))| match group.fill {
        Some(fill) => format!("{} cm: {text}", cm(fill)),
        None => text.clone(),
    });
    let text = text.map(signs).collect();
    (!each.is_empty()).then(|| (text, each.iter().all(|(_, holds)| *holds)))
}

#[cfg(test)]
mod tests {
    use super::plain;

    #[test]
    fn a_remark_in_a_page_has_the_words_of_its_links() {
        assert_eq!(plain("See [a page](page.md), [another](other.md)."), "See a page, another.");
        assert_eq!(plain("source [26]"), "source [26]");
    }
}
