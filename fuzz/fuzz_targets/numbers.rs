//! A mutator that knows what the inputs are made of: numbers in a text of lines.
//!
//! Bytes that change at random rarely leave a file that can be read, and then rarely a number at the end of its range.

/// Numbers at the ends of what formats, 32 bits and kernels hold.
#[rustfmt::skip]
const NUMBERS: &[&str] = &[
    "0", "-0.0", "1", "-1", "2", "0.5", "3", "7", "1e-3", "1e-6", "1e-9", "1e-12", "1e-15", "1e-20", "1e-30", "1e-38",
    "1e-45", "1e-160", "1e-300", "5e-324", "1e3", "1e6", "1e9", "1e12", "1e15", "1e20", "1e30", "1e36", "3.4e38",
    "1e160", "1e300", "1.7976931348623157e308", "nan", "inf", "-inf", "-1e15", "-1e12", "-1e-9", "0.999999999",
    "1.000000001", "90", "179.99", "180", "360", "0.001", "10", "255", "256", "65535", "65536", "2147483647",
    "2147483648", "4294967295", "4294967296", "9223372036854775807", "-9223372036854775808",
];

/// Numbers from a seed (xorshift).
struct Dice(u64);

impl Dice {
    fn roll(&mut self, below: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as usize % below.max(1)
    }
}

/// Changes `data`, of which `size` bytes are the input, to at most `max_size`; returns the new size.
pub fn mutate(data: &mut [u8], size: usize, max_size: usize, seed: u32) -> usize {
    let mut dice = Dice(u64::from(seed).wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
    if dice.roll(3) == 0 {
        return libfuzzer_sys::fuzzer_mutate(data, size, max_size);
    }
    let Ok(text) = std::str::from_utf8(&data[..size]) else {
        return libfuzzer_sys::fuzzer_mutate(data, size, max_size);
    };
    let mut text = text.to_owned();
    for _ in 0..=dice.roll(3) {
        text = if dice.roll(6) == 0 { with_lines_moved(&text, &mut dice) } else { with_a_number(&text, &mut dice) };
    }
    if text.len() > max_size.min(data.len()) {
        return libfuzzer_sys::fuzzer_mutate(data, size, max_size);
    }
    data[..text.len()].copy_from_slice(text.as_bytes());
    text.len()
}

/// One of its numbers replaced, scaled, or made that of another place.
fn with_a_number(text: &str, dice: &mut Dice) -> String {
    let is_part = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+');
    let mut all: Vec<(usize, usize)> = Vec::new();
    let mut start = None;
    let mut before = ' ';
    for (i, c) in text.char_indices().chain([(text.len(), ' ')]) {
        let goes_on = is_part(c) || (c == 'e' && before.is_ascii_digit());
        match start {
            None if is_part(c) && !before.is_alphanumeric() && before != '_' => start = Some(i),
            Some(from) if !goes_on => {
                all.push((from, i));
                start = None;
            }
            _ => {}
        }
        before = c;
    }
    if all.is_empty() {
        return text.to_owned();
    }
    let (from, to) = all[dice.roll(all.len())];
    let new = match dice.roll(4) {
        0 => {
            let (a, b) = all[dice.roll(all.len())];
            text[a..b].to_owned()
        }
        1 => match text[from..to].parse::<f64>() {
            Ok(x) => {
                let y = x * 10f64.powi(dice.roll(25) as i32 - 12);
                if y.is_finite() { format!("{y:e}") } else { "1e300".into() }
            }
            Err(_) => "1".into(),
        },
        _ => NUMBERS[dice.roll(NUMBERS.len())].to_owned(),
    };
    format!("{}{new}{}", &text[..from], &text[to..])
}

/// Some of its lines in a row left out, doubled, or put elsewhere.
fn with_lines_moved(text: &str, dice: &mut Dice) -> String {
    let lines: Vec<&str> = text.split_inclusive('\n').collect();
    let from = dice.roll(lines.len());
    let to = (from + 1 + dice.roll(6)).min(lines.len());
    let at = dice.roll(lines.len() + 1);
    let part = &lines[from..to];
    match dice.roll(3) {
        0 => [&lines[..from], &lines[to..]].concat().concat(),
        1 => [&lines[..at], part, &lines[at..]].concat().concat(),
        _ => {
            let rest = [&lines[..from], &lines[to..]].concat();
            let at = at.min(rest.len());
            [&rest[..at], part, &rest[at..]].concat().concat()
        }
    }
}
