//! Numbers for people.

/// 1234567 as `1,234,567`.
pub(crate) fn grouped(number: impl TryInto<u64>) -> String {
    let digits = number.try_into().unwrap_or(u64::MAX).to_string();
    let mut out = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at) % 3 == 0 {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

/// A time, to two digits or so: `0.04 s`, `12.3 s`, `4 min 05 s`, `2 h 09 min`.
pub(crate) fn seconds(seconds: f64) -> String {
    match seconds {
        s if s < 9.995 => format!("{s:.2} s"),
        s if s < 59.95 && s.fract() == 0.0 => format!("{s} s"),
        s if s < 59.95 => format!("{s:.1} s"),
        s if s < 3599.5 => format!("{} min {:02} s", s.round() as u64 / 60, s.round() as u64 % 60),
        s => format!("{} h {:02} min", s.round() as u64 / 3600, s.round() as u64 % 3600 / 60),
    }
}

/// A share of 1 as `12 %`, `0.3 %`, `2e-5 %`.
pub(crate) fn percent(share: f64) -> String {
    match 100.0 * share {
        p if p == 0.0 || p.abs() >= 9.95 => format!("{p:.0} %"),
        p if p.abs() >= 0.0095 => format!("{p:.2} %"),
        p => format!("{p:.0e} %"),
    }
}

/// Bytes in units of a thousand: `12 MB`, `3.4 GB`.
pub(crate) fn bytes(bytes: u64) -> String {
    let mut number = bytes as f64;
    for unit in ["bytes", "kB", "MB", "GB"] {
        if number < 999.5 {
            return match unit {
                "bytes" => format!("{number:.0} {unit}"),
                _ if number < 9.95 => format!("{number:.1} {unit}"),
                _ => format!("{number:.0} {unit}"),
            };
        }
        number /= 1000.0;
    }
    format!("{number:.1} TB")
}

/// A measure of the scene, to five significant digits and no more zeros than it needs.
pub(crate) fn measure(number: f64) -> String {
    if number == 0.0 {
        return "0".into();
    }
    let exponent = number.abs().log10().floor();
    if !(-4.0..9.0).contains(&exponent) {
        return format!("{number:.4e}");
    }
    let text = format!("{:.*}", (4.0 - exponent).max(0.0) as usize, number.abs());
    let (whole, part) = text.split_once('.').unwrap_or((&text, ""));
    let sign = if number < 0.0 { "-" } else { "" };
    let point = if part.trim_end_matches('0').is_empty() { "" } else { "." };
    format!(
        "{sign}{}{point}{}",
        grouped(whole.parse::<u64>().unwrap_or_default()),
        part.trim_end_matches('0')
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands() {
        for (number, text) in [(0, "0"), (999, "999"), (1000, "1,000"), (1_234_567, "1,234,567")] {
            assert_eq!(grouped(number as u64), text);
        }
    }

    #[test]
    fn times() {
        for (time, text) in [
            (0.0, "0.00 s"),
            (9.999, "10.0 s"),
            (59.96, "1 min 00 s"),
            (3599.6, "1 h 00 min"),
            (7740.0, "2 h 09 min"),
        ] {
            assert_eq!(seconds(time), text);
        }
    }

    #[test]
    fn sizes() {
        for (size, text) in [
            (0, "0 bytes"),
            (999, "999 bytes"),
            (1_000, "1.0 kB"),
            (25_000_000_000, "25 GB"),
            (9_999, "10 kB"),
        ] {
            assert_eq!(bytes(size), text);
        }
    }

    #[test]
    fn measures() {
        for (number, text) in [
            (0.0, "0"),
            (2.0, "2"),
            (-0.5, "-0.5"),
            (555.123_456, "555.12"),
            (0.000_123_456_7, "0.00012346"),
            (1e-9, "1.0000e-9"),
            (-123_456_789.0, "-123,456,789"),
            (0.999_999_9, "1"),
            (1234.5, "1,234.5"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(measure(number), text);
        }
    }
}
