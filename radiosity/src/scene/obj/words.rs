//! Statements of OBJ and MTL files: a line each, of words between white space.

use crate::scene::source::{Source, Spot};
use crate::scene::{Place, SceneError, number};

/// A word, and where in the text it begins.
#[derive(Clone, Copy, Debug)]
pub(super) struct Word<'a> {
    pub(super) text: &'a str,
    pub(super) start: usize,
}

/// The words of one statement; the first tells which it is.
#[derive(Clone, Debug, Default)]
pub(super) struct Statement<'a> {
    pub(super) words: Vec<Word<'a>>,
    /// All that follows the first word, for names with spaces in them.
    pub(super) rest: &'a str,
    /// The line it begins on.
    pub(super) line: u32,
}

/// Reads statements one after the other.
pub(super) struct Statements<'a> {
    pub(super) source: &'a Source<'a>,
    at: usize,
    line: u32,
}

impl<'a> Statements<'a> {
    pub(super) fn new(source: &'a Source<'a>) -> Self {
        Self { source, at: 0, line: 1 }
    }

    /// Put the next statement into `statement`; false at the end of the file. Lines of white space and comments are
    /// passed over. A `\` at the end of a line joins the next to it.
    pub(super) fn next(&mut self, statement: &mut Statement<'a>) -> bool {
        let text: &'a str = &self.source.text;
        statement.words.clear();
        while self.at < text.len() {
            let start = self.at;
            let end = text[start..].find(['\n', '\r']).map_or(text.len(), |length| start + length);
            self.at = end + if text[end..].starts_with("\r\n") { 2 } else { 1 };
            if statement.words.is_empty() {
                statement.line = self.line;
                statement.rest = "";
            }
            self.line += 1;
            let whole = &text[start..end];
            let (content, joined) = match whole.trim_end().strip_suffix('\\') {
                Some(before) => (before, true),
                None => (whole, false),
            };
            let mut at = 0;
            while let Some(begin) = content[at..].find(|c: char| !c.is_whitespace()).map(|k| at + k) {
                if content[begin..].starts_with('#') {
                    break;
                }
                let length = content[begin..].find(char::is_whitespace).unwrap_or(content.len() - begin);
                let first = statement.words.is_empty();
                statement.words.push(Word { text: &content[begin..begin + length], start: start + begin });
                at = begin + length;
                if first {
                    statement.rest = content[at..].trim();
                }
            }
            if !joined && !statement.words.is_empty() {
                return true;
            }
        }
        !statement.words.is_empty()
    }

    /// An error at a word.
    pub(super) fn error(
        &self,
        word: Word<'_>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> SceneError {
        self.source.error(self.spot(word), message, help)
    }

    fn spot(&self, word: Word<'_>) -> Spot {
        let length = word.text.chars().count() as u32;
        Spot { start: word.start, length, place: self.source.place_of(word.start) }
    }

    /// Word `k` of the statement that begins at `start`.
    pub(super) fn word_after(&self, start: usize, k: usize) -> Word<'a> {
        let mut again = Self { source: self.source, at: start, line: 1 };
        let mut statement = Statement::default();
        again.next(&mut statement);
        let begin = Word { text: &self.source.text[start..start], start };
        statement.words.get(k).copied().unwrap_or(begin)
    }

    /// The word's line and column.
    pub(super) fn place(&self, word: Word<'_>) -> Place {
        self.source.place_of(word.start)
    }

    /// `N` numbers after the statement's first word; more may follow.
    pub(super) fn numbers<const N: usize>(&self, statement: &Statement<'_>) -> Result<[f64; N], SceneError> {
        let [keyword, numbers @ ..] = &statement.words[..] else { return Ok([0.0; N]) };
        let mut values = [0.0; N];
        for (k, value) in values.iter_mut().enumerate() {
            let Some(word) = numbers.get(k) else {
                let had = if k == 0 { "none follows".into() } else { format!("only {k} follow") };
                let message = format!("{} needs {N} numbers, {had}", keyword.text);
                return Err(self.error(
                    *keyword,
                    message,
                    "write the missing numbers, or leave the line out",
                ));
            };
            *value = number::real(word.text).map_err(|bad| self.error(*word, bad.message, bad.help))?;
        }
        Ok(values)
    }
}
