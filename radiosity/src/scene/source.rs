//! The text of a file, whatever it was encoded in, and errors that show the line at fault.

use std::borrow::Cow;

use super::{Place, SceneError};

/// The longest excerpt shown of a line, in characters; a scene may well be one line of 100 MB.
const EXCERPT: usize = 120;
/// How much of an excerpt stands before the fault when the line is cut.
const BEFORE_FAULT: usize = 50;

/// A file's name and its text.
#[derive(Debug)]
pub(super) struct Source<'a> {
    pub(super) file: String,
    pub(super) text: Cow<'a, str>,
}

/// A stretch of the text that a message can point at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Spot {
    /// Byte offset of its first character.
    pub(super) start: usize,
    /// Length in characters.
    pub(super) length: u32,
    pub(super) place: Place,
}

impl Spot {
    /// The very beginning of a text, for faults of the whole of it.
    pub(super) const START: Self = Self { start: 0, length: 1, place: Place { line: 1, column: 1 } };
}

impl<'a> Source<'a> {
    /// Text of UTF-8 or Latin-1, even mixed: old files have French comments in one, editors since add the
    /// other. A byte-order mark, and the Ctrl-Z that ended text files under DOS, are left out.
    pub(super) fn new(file: &str, bytes: &'a [u8]) -> Result<Self, SceneError> {
        let file = file.to_owned();
        if let Some(read) = utf16(bytes) {
            // Only enough of it to show the first line.
            let units = bytes[..bytes.len().min(4096)].chunks_exact(2).map(|pair| read([pair[0], pair[1]]));
            let text: String = char::decode_utf16(units).map(|c| c.unwrap_or('\u{fffd}')).collect();
            let text = Cow::Owned(text.trim_start_matches('\u{feff}').to_owned());
            return Err(Source { file, text }.error(
                Spot::START,
                "the file is UTF-16 text, two bytes a character",
                "save it as UTF-8, or as plain text",
            ));
        }
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let bytes = bytes.strip_suffix(b"\x1a").unwrap_or(bytes);
        let source = Self { file, text: decode(bytes) };
        // Checked in the text, so that the offset is one of the text; NUL is NUL in either encoding.
        if let Some(start) = source.text.bytes().position(|byte| byte == 0) {
            let place = source.place_of(start);
            return Err(source.error(
                Spot { start, length: 1, place },
                "a NUL byte: the file is binary, not text",
                "give a text file; this one may be a picture, an archive, or damaged",
            ));
        }
        Ok(source)
    }

    /// The one error of a file, at `spot`.
    pub(super) fn error(
        &self,
        spot: Spot,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> SceneError {
        let is_end = |c: char| c == '\n' || c == '\r';
        let begin = self.text[..spot.start].rfind(is_end).map_or(0, |end| end + 1);
        let before = &self.text[begin..spot.start];
        let after = &self.text[spot.start..];
        let after = &after[..after.find(is_end).unwrap_or(after.len())];

        // Characters, not bytes; of a long line only as many as are shown are ever counted.
        let left: Vec<char> = before.chars().rev().take(EXCERPT + 1).collect();
        let right: Vec<char> = after.chars().take(EXCERPT + 1).collect();
        let whole = left.len() + right.len() <= EXCERPT;
        let left_kept = if whole { left.len() } else { left.len().min(BEFORE_FAULT) };
        let right_kept = if whole { right.len() } else { right.len().min(EXCERPT - left_kept) };

        let mut line = String::new();
        if left_kept < left.len() {
            line.push('…');
        }
        line.extend(left[..left_kept].iter().rev().copied().map(visible));
        let caret = line.chars().count() as u32;
        line.extend(right[..right_kept].iter().copied().map(visible));
        if right_kept < right.len() {
            line.push('…');
        }
        SceneError::Syntax {
            file: self.file.clone(),
            place: spot.place,
            length: spot.length.min(right_kept as u32).max(1),
            line,
            caret,
            message: message.into(),
            help: help.into(),
        }
    }

    /// Line and column of a byte offset, counted from the beginning of the file.
    pub(super) fn place_of(&self, offset: usize) -> Place {
        let mut counter = Counter::default();
        let mut rest = self.text[..offset].chars().peekable();
        while let Some(c) = rest.next() {
            counter.pass(c, rest.peek().copied());
        }
        counter.place
    }
}

/// Counts lines that end in LF, CR LF or CR alone, and columns in characters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Counter {
    pub(super) place: Place,
}

impl Default for Counter {
    fn default() -> Self {
        Self { place: Place { line: 1, column: 1 } }
    }
}

impl Counter {
    /// Go past `c`, which `next` follows.
    pub(super) fn pass(&mut self, c: char, next: Option<char>) {
        if c == '\n' || (c == '\r' && next != Some('\n')) {
            self.place = Place { line: self.place.line + 1, column: 1 };
        } else {
            self.place.column += 1;
        }
    }
}

/// How to read a pair of bytes, where the file is UTF-16: by its byte-order mark, or by NULs in every other
/// place among the first characters.
fn utf16(bytes: &[u8]) -> Option<fn([u8; 2]) -> u16> {
    match *bytes {
        [0xff, 0xfe, ..] => Some(u16::from_le_bytes),
        [0xfe, 0xff, ..] => Some(u16::from_be_bytes),
        [1..=255, 0, 1..=255, 0, ..] => Some(u16::from_le_bytes),
        [0, 1..=255, 0, 1..=255, ..] => Some(u16::from_be_bytes),
        _ => None,
    }
}

fn decode(bytes: &[u8]) -> Cow<'_, str> {
    if let Ok(text) = std::str::from_utf8(bytes) {
        return Cow::Borrowed(text);
    }
    let mut text = String::with_capacity(bytes.len() + bytes.len() / 16);
    for chunk in bytes.utf8_chunks() {
        text.push_str(chunk.valid());
        text.extend(chunk.invalid().iter().map(|&latin1| char::from(latin1)));
    }
    Cow::Owned(text)
}

/// The character itself, or one that a terminal can show in its place.
fn visible(c: char) -> char {
    match c {
        '\t' => ' ',
        // The pictures of control characters, ␀ to ␟, and of delete.
        '\0'..='\x1f' => char::from_u32(0x2400 + c as u32).unwrap_or('?'),
        '\x7f' => '␡',
        // Marks that would turn the direction of the line around, and further line ends.
        '\u{80}'..='\u{9f}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => {
            '\u{fffd}'
        }
        _ => c,
    }
}

/// Any word as messages quote it.
pub(super) fn quoted(text: &str) -> String {
    const LONGEST: usize = 24;
    let mut shown: String = text.chars().take(LONGEST).map(visible).collect();
    if text.chars().nth(LONGEST).is_some() {
        shown.push('…');
    }
    format!("`{shown}`")
}
