//! Every way to write a scene wrongly gives one message, with its place, and a cure.

use radiosity::scene::SceneError;
use radiosity::scene::n3d::parse_scene;

fn error(text: impl AsRef<[u8]>) -> SceneError {
    match parse_scene("a.scn", text.as_ref()) {
        Ok(_) => panic!("read without an error: {}", String::from_utf8_lossy(text.as_ref())),
        Err(error) => error,
    }
}

fn help(text: &str) -> String {
    match error(text) {
        SceneError::Syntax { help, .. } => help,
        SceneError::File { .. } => panic!("no place"),
    }
}

const QD: &str = "QD 1 1 0 0 0 1 0 0 1 1 0 0 1 0";

#[test]
fn each_fault_is_told_in_plain_words_at_its_place() {
    let fractals = "FR 8 0 0 0 0 0 1 0 0 0 1 0 ID\n".repeat(62);
    let cases: &[(&str, &str)] = &[
        // Files without a scene.
        ("", "1:1: the file is empty"),
        ("# nothing\n\n// yet\n", "1:1: the file holds no object, only white space or comments"),
        ("\n OC FI ID", "2:2: the scene has no surface, so there is nothing to light"),
        ("PT 1 2 3 ID", "1:1: the scene has no surface, so there is nothing to light"),
        // Words.
        ("XX 1 2", "1:1: `XX` begins no object"),
        ("qd 1 1", "1:1: `qd` begins no object"),
        ("QD4 8", "1:1: `QD4` begins no object"),
        ("12", "1:1: `12` stands where an object should begin"),
        ("CD 1 1 1", "1:1: CD stands outside any object"),
        ("é", "1:1: `é` begins no object"),
        ("TI 0 0 0 1 0 0 0 1 0\n  cd 1 1 1 ID", "2:3: `cd` is no attribute of the TI of line 1"),
        ("TI 0 0 0 1 0 0 0 1 0 5 ID", "1:22: `5` is one number too many"),
        // Beginnings and ends.
        ("FI ID", "1:1: FI closes no composite: none is open here"),
        ("ID", "1:1: ID closes no object: none is open here"),
        ("OC\n  ID", "2:3: ID closes no object: none is open here"),
        ("OC TI 0 0 0 1 0 0 0 1 0 ID", "1:1: this OC is not closed: the file ends before its FI"),
        ("OC\n OC\n", "2:2: this OC is not closed: the file ends before its FI (2 composites are open)"),
        ("OC FI CD 1 1 1", "1:1: this OC has no ID: the file ends after its FI before it"),
        ("TI 0 0 0 1 0 0 0 1 0", "1:1: this TI has no ID: the file ends before it"),
        ("TI 0 0 0 1 0 0 0 1 0\nTI", "2:1: the next object begins before the ID of the TI of line 1"),
        ("OC TI 0 0 0 1 0 0 0 1 0 FI", "1:25: FI comes before the ID of the TI of line 1"),
        // Too few numbers.
        ("QD", "1:1: QD needs n and m before its 4 points, the file ends after it"),
        ("QD 4", "1:1: QD needs n and m before its 4 points, the file ends after n"),
        ("\n  QD 1 1 0 0 0 1 0 0 1 1 0", "2:3: QD needs 4 points, the file ends after 3"),
        ("QD 1 1 0 0 0 1 0", "1:1: QD needs 4 points, the file ends after 1 and 2 numbers"),
        ("TI 0 0 0 1 0 0 CD 1 1 1 ID", "1:16: TI needs 3 points, but CD comes after 2"),
        ("TI 0 ID", "1:6: TI needs 3 points, but ID comes after 1 number"),
        ("PG 0 0 0 1 0 0 1 1 0 ID", "1:22: PG needs its first point again to end it, but ID comes after 3"),
        ("PG 0 0 0 1 0 0 1 1 0", "1:1: PG needs its first point again to end it, the file ends after 3"),
        ("PG 0 0 0 1 0 0 0 0 0 ID", "1:16: PG needs at least 3 points, its first comes again after 2"),
        ("TI 0 0 0 1 0 0 0 1 0 CE 1 1 ID", "1:29: CE needs 3 numbers (r g b), but ID comes after 2"),
        ("TI 0 0 0 1 0 0 0 1 0 GD", "1:22: GD needs 1 number (a grey), the file ends after it"),
        (
            "TI 0 0 0 1 0 0 0 1 0 MA 1 0 0 0 0 1",
            "1:22: MA needs 24 numbers (a matrix of 3 rows of 4, and its inverse), the file ends after 6",
        ),
        // Numbers that are none.
        ("TI 0 O 0", "1:6: `O` is not a number"),
        ("TI 0 0,5 0", "1:6: `0,5` is not a number"),
        ("TI 0 nan 0", "1:6: `nan` is no number a scene can use"),
        ("TI 0 -inf 0", "1:6: `-inf` is no number a scene can use"),
        ("TI 0 1e999 0", "1:6: `1e999` is too large: numbers go up to 1e15"),
        ("TI 0 1e16 0", "1:6: `1e16` is too large: numbers go up to 1e15"),
        ("TI 0 0x10 0", "1:6: `0x10` is not a number"),
        ("TI 0 1/2 0", "1:6: `1/2` is not a number"),
        // QD.
        ("QD 0 1", "1:4: QD is cut into 1 to 10000 patches a side, and n is 0"),
        ("QD 1 -3", "1:6: QD is cut into 1 to 10000 patches a side, and m is -3"),
        ("QD 1 10001", "1:6: QD is cut into 1 to 10000 patches a side, and m is 10001"),
        ("QD 1.5 1", "1:4: `1.5` is not a whole number"),
        ("QD 99999999999999999999 1", "1:4: `99999999999999999999` is too large"),
        (
            "QD 1 1 0 0 0 4 0 0 1 1 0 0 4 0 ID",
            "1:20: QD is concave at its point 3: it is cut between opposite sides, which takes a convex one",
        ),
        ("QD 1 1 0 0 0 2 0 0 1 1 0 0 2 0 ID", "1:20: QD has its point 3 on the line between its neighbours"),
        ("QD 1 1 0 0 0 1 0 0 0 1 0 1 1 0 ID", "1:20: QD crosses itself"),
        ("QD 1 1 0 0 0 1 0 0 1 1 0 1 1 0 ID", "1:26: QD has its points 3 and 4 in one place"),
        ("QD 1 1 0 0 0 0 0 0 0 1 0 0 1 0 ID", "1:14: QD has its points 1 and 2 in one place: no area"),
        ("QD 1 1 0 0 0 1 0 0 1 0 0 0 0 0 ID", "1:26: QD has its points 1 and 4 in one place: no area"),
        ("QD 1 1 0 0 0 1 0 0 3 0 0 2 0 0 ID", "1:1: QD has all its points on one line: no area"),
        ("QD 1 1 5 5 5 5 5 5 5 5 5 5 5 5 ID", "1:1: QD has all its points in one place"),
        // PG and TI.
        ("TI 0 0 0 1 0 0 2 0 0 ID", "1:1: TI has all its points on one line: no area"),
        ("TI 0 0 0 1 0 0 1 0 0 ID", "1:16: TI has its points 2 and 3 in one place"),
        ("TI 0 0 0 1e-17 0 0 0 1e-17 0 ID", "1:1: TI is smaller than 1e-15"),
        (
            "PG 0 0 0 1 0 0 1 1 .1 0 1 0 0 0 0 ID",
            "1:1: PG is not flat: its points lie up to 0.0499 out of one plane",
        ),
        (
            "PG 0 0 0 3 3 0 3 0 0 0 1 0 0 0 0 ID",
            "1:1: PG crosses or touches itself: see its edges 1-2 and 3-4",
        ),
        (
            "PG 0 0 0 1 1 0 1 0 0 0 1 0 0 0 0 ID",
            "1:1: PG crosses or touches itself: see its edges 1-2 and 3-4",
        ),
        // VO.
        ("VO x", "1:4: `x` is not a number"),
        (
            "VO 0 0",
            "1:1: VO needs a real and 2 whole numbers, then its points, the file ends after 2 of them",
        ),
        ("VO 0 0 0 2", "1:10: VO needs at least 3 points, and this says 2"),
        ("VO 0 0 0 -1", "1:10: VO needs at least 3 points, and this says -1"),
        ("VO 0 0 0 99999999999", "1:10: VO cannot have 99999999999 points"),
        ("VO 0 0 0 4000000000 1 2 3", "1:1: VO needs 4000000000 points, the file ends after 1"),
        ("VO 0 0 0 3 0 0 0 1 0 0 0 1 0 0", "1:30: VO needs at least 1 triangle, and this says 0"),
        (
            "VO 0 0 0 3 0 0 0 1 0 0 0 1 0 1 0 1 2",
            "1:32: VO has points 1 to 3, and its triangle 1 asks for point 0",
        ),
        (
            "VO 0 0 0 3 0 0 0 1 0 0 0 1 0 1 1 2 4",
            "1:36: VO has points 1 to 3, and its triangle 1 asks for point 4",
        ),
        ("VO 0 0 0 3 0 0 0 1 0 0 0 1 0 1 1 2 2", "1:32: VO has no area in its triangle 1"),
        (
            "VO 0 0 0 3 0 0 0 1 0 0 0 1 0 2 1 2 3 1 2",
            "1:1: VO needs 2 triangles of 3 indices, the file ends after 1 and 2 indices",
        ),
        // SP, CL and FR.
        ("SP NM 2 12 ID", "1:7: SP is cut into 3 to 10000 patches, and n is 2"),
        ("SP NM 3 1 ID", "1:9: SP is cut into 2 to 10000 patches, and m is 1"),
        ("CL NM 3 0 ID", "1:9: CL is cut into 1 to 10000 patches, and m is 0"),
        ("SP NM 24 ID", "1:10: NM needs n and m, but ID comes after n"),
        (
            "TI 0 0 0 1 0 0 0 1 0 NM 3 3 ID",
            "1:22: NM cuts an SP or a CL into patches, and this is the TI of line 1",
        ),
        (
            "TI 0 0 0 1 0 0 0 1 0 IN ID",
            "1:22: IN turns the front of an SP or a CL inward, and this is the TI of line 1",
        ),
        ("SP HO 0 0 0 1 0 0 1e-10 ID", "1:1: this object, where its transforms take it, is squashed flat"),
        ("FR 9", "1:4: FR is cut 0 to 8 times, and its depth is 9"),
        ("FR 2 .6", "1:6: FR's roughness is 0 to 0.5, and this is 0.6"),
        ("FR 2 .1 5 0 0 0 ID", "1:17: FR needs 3 points, but ID comes after 1"),
        ("FR 2 .1 5 0 0 0 1 0 0 2 0 0 ID", "1:1: FR has all its points on one line: no area"),
        (&fractals, "62:4: the FR up to this one make more than 4000000 triangles"),
        // Never.
        ("PL 0 0 1 0 ID", "1:1: PL is an infinite plane, which cannot be cut into patches"),
    ];
    for (text, message) in cases {
        let error = error(text);
        assert_eq!(error.to_string(), format!("a.scn:{message}"), "for {text:?}");
        assert!(matches!(error, SceneError::Syntax { ref help, .. } if !help.is_empty()));
    }
}

#[test]
fn attributes_are_told_as_well() {
    for (attribute, message) in [
        ("CD -.1 0 0", "CD is negative: a surface cannot reflect less than nothing"),
        ("GD -1", "GD is negative: a surface cannot reflect less than nothing"),
        ("CE 0 0 -1", "CE is negative: a surface cannot emit less than nothing"),
        ("HO 0 0 0 0 0 0 1", "HO's vector is zero"),
        ("HO 0 0 0 1 0 0 0", "HO by a factor of zero would flatten the object"),
        ("RT 0 0 0 0 0 0 1", "RT's axis is zero"),
        ("CZ 0 0 0 0 0 0 1 1 1", "CZ's first vector is zero"),
        ("CZ 0 0 0 0 0 1 0 0 -1", "CZ with these vectors would flatten the object"),
        ("AV 0 0 0 1 0 0", "AV's first vector is zero"),
        ("AV 1 0 0 0 0 0", "AV's second vector is zero"),
        (
            "MA 1 0 0 0 0 1 0 0 1 1 0 0 1 0 0 0 0 1 0 0 0 0 1 0",
            "MA's matrix is singular: it would flatten the object",
        ),
    ] {
        let text = format!("{QD}\n {attribute} ID");
        assert_eq!(error(&text).to_string(), format!("a.scn:2:2: {message}"));
    }
}

#[test]
fn a_child_that_its_composite_squashes_is_named() {
    let text = format!("OC\n  OC\n    {QD} ID\n  FI ID\nFI HO 0 0 0 1 0 0 1e-9 HO 0 0 0 1 0 0 1e-9 ID");
    assert_eq!(
        error(text).to_string(),
        "a.scn:3:5: this object, where its transforms and those of the composite of line 2 take it, has all its \
         points on one line: no area"
    );
    let text = format!("{QD} TR 1e15 0 0 TR 1e15 0 0 ID");
    assert_eq!(
        error(text).to_string(),
        "a.scn:1:1: this object, where its transforms take it, reaches beyond 1e15"
    );
    let scales = "HO 0 0 0 1 0 0 1e15 ".repeat(3);
    assert_eq!(
        error(format!("{QD} {scales} ID")).to_string(),
        "a.scn:1:52: HO and the transforms before it make numbers too large"
    );
}

#[test]
fn the_cure_guesses_what_was_meant() {
    for (text, cure) in [
        ("qd 1 1", "did you mean QD? Keywords are two capital letters"),
        ("QD4 8", "did you mean QD? Put white space after it: `QD 4`"),
        ("QB 4 8", "did you mean QD?"),
        ("/* a box */", "comments begin with # or // and end with the line"),
        ("TI 0,5", "numbers are written with a point, as `0.5`, and separated by white space"),
        ("TI 1,", "numbers are separated by white space, without commas"),
        ("TI 1.0f", "write the number alone, with white space around it"),
        (
            "QD 1 1 0 0 0 1 0 0 0 1 0 1 1 0",
            "exchange its last two points: corners are written around the outline",
        ),
        ("OC ID", "take it out; to close the composite, write FI first"),
        ("TI 0 0 0 1 0 0 0 1 0 ID.", "did you mean ID? Put white space after it"),
        (
            "TI 0 0 0 1 0 0 0 1 0 XY",
            "attributes are CD, CE, GD and the other coefficients, TR HO RT CZ AV MA, NM IN, and ID to end them",
        ),
    ] {
        assert_eq!(help(text), cure, "for {text}");
    }
}

#[test]
fn places_count_lines_of_every_ending_and_columns_in_characters() {
    for text in ["\n\nXX", "\r\n\r\nXX", "\r\rXX", "# é\r\n// ü\rXX", "\u{feff}\n\nXX"] {
        assert_eq!(error(text).to_string(), "a.scn:3:1: `XX` begins no object", "for {text:?}");
    }
    assert_eq!(error(b"# caf\xe9 \xff\n\tXX").to_string(), "a.scn:2:2: `XX` begins no object");
    assert_eq!(error("TI 0 é").to_string(), "a.scn:1:6: `é` is not a number");
}

#[test]
fn the_excerpt_shows_the_line_and_the_caret_its_fault() {
    let SceneError::Syntax { line, caret, length, .. } = error("# one\n\tTI 0 zero 0\n# three") else {
        panic!()
    };
    assert_eq!((line.as_str(), caret, length), (" TI 0 zero 0", 6, 4));
    // A long line is cut about the fault.
    let text = format!("{}TI zero{}", "TI 0 0 0 1 0 0 0 1 0 ID ".repeat(100_000), " 1".repeat(1_000_000));
    let SceneError::Syntax { line, caret, length, place, .. } = error(text) else { panic!() };
    assert_eq!((place.line, place.column, length), (1, 2_400_004, 4));
    let shown: Vec<char> = line.chars().collect();
    assert!(shown.len() <= 122 && shown[0] == '…' && shown[shown.len() - 1] == '…');
    assert_eq!(shown[caret as usize..][..4].iter().collect::<String>(), "zero");
    // A word without end is quoted and underlined only as far as it is shown.
    let error = error("A".repeat(1_000_000));
    assert!(error.to_string().len() < 100);
    let SceneError::Syntax { line, length, .. } = error else { panic!() };
    assert!(length as usize <= line.chars().count());
}

#[test]
fn what_is_no_text_is_named() {
    for text in [&b"TI 0 0\0"[..], b"\x89PNG\r\n\x1a\n\0\0\0"] {
        assert!(error(text).to_string().ends_with("a NUL byte: the file is binary, not text"));
    }
    assert!(error(b"TI\n 0\0").to_string().starts_with("a.scn:2:3: "));
    let utf16 = |convert: fn(u16) -> [u8; 2], mark: &str| -> Vec<u8> {
        format!("{mark}TI 0 0 0").encode_utf16().flat_map(convert).collect()
    };
    for bytes in [
        utf16(u16::to_le_bytes, "\u{feff}"),
        utf16(u16::to_be_bytes, "\u{feff}"),
        utf16(u16::to_le_bytes, ""),
        utf16(u16::to_be_bytes, ""),
    ] {
        let error = error(bytes);
        assert_eq!(error.to_string(), "a.scn:1:1: the file is UTF-16 text, two bytes a character");
        assert!(matches!(error, SceneError::Syntax { line, .. } if line == "TI 0 0 0"));
    }
}

#[test]
fn depth_and_size_are_bounded() {
    let deep = |depth: usize| format!("{}{QD} ID{}", "OC ".repeat(depth), " FI ID".repeat(depth));
    assert!(parse_scene("a.scn", deep(1_000).as_bytes()).is_ok());
    let message = "a.scn:1:3001: more than 1000 composites stand in one another";
    assert_eq!(error(deep(1_001)).to_string(), message);
    assert_eq!(error("OC ".repeat(1_000_000)).to_string(), message);
    let endless: String = (0..2_500).map(|k| format!("{k} {} 0 ", k * k)).collect();
    assert_eq!(
        error(format!("PG {endless}")).to_string(),
        "a.scn:1:1: PG has more than 2000 points, and its first has not come again"
    );
}
