//! From text to tokens: whatever stands between white space, each with its place.

use super::source::{Counter, Source, Spot, quoted};

/// What stands between two stretches of white space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Token<'a> {
    pub(super) text: &'a str,
    pub(super) spot: Spot,
}

impl Token<'_> {
    /// The token as messages quote it: short, and safe to print.
    pub(super) fn quoted(&self) -> String {
        quoted(self.text)
    }
}

/// Reads tokens one after the other, and looks one ahead.
pub(super) struct Lexer<'a> {
    text: &'a str,
    at: usize,
    counter: Counter,
    ahead: Option<Token<'a>>,
}

impl<'a> Lexer<'a> {
    pub(super) fn new(source: &'a Source<'_>) -> Self {
        let mut lexer = Self { text: &source.text, at: 0, counter: Counter::default(), ahead: None };
        lexer.ahead = lexer.scan();
        lexer
    }

    /// The token that [`Self::next`] will give.
    pub(super) fn peek(&self) -> Option<Token<'a>> {
        self.ahead
    }

    /// The next token; `None` at the end of the file, as often as asked.
    pub(super) fn next(&mut self) -> Option<Token<'a>> {
        let token = self.ahead.take();
        if token.is_some() {
            self.ahead = self.scan();
        }
        token
    }

    fn scan(&mut self) -> Option<Token<'a>> {
        let mut comment = false;
        while let Some((c, starts_comment)) = self.current() {
            match c {
                '\n' | '\r' => comment = false,
                _ if comment || c.is_whitespace() => {}
                _ if starts_comment => comment = true,
                _ => break,
            }
            self.pass(c);
        }
        let start = self.at;
        let place = self.counter.place;
        while let Some((c, starts_comment)) = self.current() {
            if c.is_whitespace() || starts_comment {
                break;
            }
            self.pass(c);
        }
        let length = self.counter.place.column - place.column;
        (self.at > start)
            .then(|| Token { text: &self.text[start..self.at], spot: Spot { start, length, place } })
    }

    /// The character to come, and whether a comment begins with it.
    fn current(&self) -> Option<(char, bool)> {
        let rest = &self.text[self.at..];
        let c = rest.chars().next()?;
        Some((c, c == '#' || rest.starts_with("//")))
    }

    fn pass(&mut self, c: char) {
        self.at += c.len_utf8();
        // Only a CR asks what follows it.
        let next = if c == '\r' { self.current().map(|(next, _)| next) } else { None };
        self.counter.pass(c, next);
    }
}
