//! Progress bars on a terminal. The libraries only report their progress; this module displays it.

use std::io;
use std::sync::{Mutex, PoisonError};

use anyhow::Result;
use experiments::progress::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle, TermLike};

use crate::terminal;

pub fn steps_bar() -> Result<ProgressBar> {
    bar("{bar:40} {percent:>3} %  {elapsed} elapsed, {eta} left")
}

pub fn runs_bar() -> Result<ProgressBar> {
    bar("{msg} {bar:40} {percent:>3} %  {elapsed} elapsed, {eta} left")
}

pub fn rules_bar() -> Result<ProgressBar> {
    bar("{bar:40} {pos} of {len} rules of calls  {elapsed} elapsed, {eta} left")
}

pub fn search_spinner() -> Result<ProgressBar> {
    let spinner = bar("{spinner} {elapsed}  {msg}")?;
    spinner.enable_steady_tick(std::time::Duration::from_millis(200));
    Ok(spinner)
}

pub fn show_line(bar: &ProgressBar, line: &str) {
    // If the bar is hidden, indicatif would drop the line.
    if bar.is_hidden() {
        terminal::note(line);
    } else {
        bar.println(line);
        bar.set_message(line.to_string());
    }
}

fn bar(template: &str) -> Result<ProgressBar> {
    let bar = ProgressBar::new(0).with_style(ProgressStyle::with_template(template)?);
    if terminal::has_reader() {
        let messages = Box::new(Messages::default());
        bar.set_draw_target(ProgressDrawTarget::term_like_with_hz(messages, 5));
        return Ok(bar);
    }
    if terminal::is_quiet() {
        bar.set_draw_target(ProgressDrawTarget::hidden());
        return Ok(bar);
    }
    #[cfg(unix)]
    if let Some((_, stderr)) = host::guard::streams() {
        let terminal = console::Term::read_write_pair(stderr.try_clone()?, stderr.try_clone()?);
        bar.set_draw_target(ProgressDrawTarget::term(terminal, 20));
    }
    Ok(bar)
}

/// A terminal with a single line. Each line that the progress bar draws on it is sent as a message
/// to the program that started this one.
#[derive(Debug, Default)]
struct Messages {
    line: Mutex<String>,
}

impl Messages {
    fn change(&self, change: impl FnOnce(&mut String)) -> io::Result<()> {
        change(&mut self.line.lock().unwrap_or_else(PoisonError::into_inner));
        Ok(())
    }
}

impl TermLike for Messages {
    fn width(&self) -> u16 {
        100
    }

    fn move_cursor_up(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn move_cursor_down(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn move_cursor_right(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn move_cursor_left(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn write_line(&self, text: &str) -> io::Result<()> {
        self.change(|line| {
            // indicatif pads the line with spaces.
            if !text.trim().is_empty() {
                *line = text.trim().into();
            }
        })
    }

    fn write_str(&self, text: &str) -> io::Result<()> {
        self.write_line(text)
    }

    fn clear_line(&self) -> io::Result<()> {
        Ok(())
    }

    fn flush(&self) -> io::Result<()> {
        self.change(|line| {
            if !line.is_empty() {
                let text = serde_json::Value::from(std::mem::take(line));
                terminal::message("progress", &text.to_string());
            }
        })
    }
}

pub fn show(bar: &ProgressBar, news: Progress) {
    match news {
        Progress::Begins { runs, steps } => {
            bar.set_length(steps);
            bar.set_message(format!("{runs} runs"));
        }
        Progress::Steps(steps) => bar.inc(steps),
        // If the bar is hidden, indicatif would drop the line.
        Progress::Note(line) if bar.is_hidden() => terminal::note(line),
        Progress::Note(line) => bar.println(line),
    }
}
