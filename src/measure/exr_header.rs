//! Facts in the headers of the EXR files that Cusp writes.

use exr::meta::MetaData;
use exr::meta::attribute::AttributeValue;

/// Header attribute that holds all facts, `key = value` line by line.
const ATTRIBUTE: &str = "cusp";

/// The facts in the header of an EXR file's bytes, in order; none in a file that Cusp did not write.
pub fn facts(exr: &[u8]) -> Vec<(String, String)> {
    let Ok(meta) = MetaData::read_from_buffered(exr, false) else {
        return Vec::new();
    };
    let own = meta.headers.iter().flat_map(|h| &h.own_attributes.other).find(|(k, _)| **k == *ATTRIBUTE);
    match own {
        Some((_, AttributeValue::Text(text))) => text
            .to_string()
            .lines()
            .filter_map(|line| line.split_once(" = "))
            .map(|(k, v)| (k.to_owned(), v.to_owned()))
            .collect(),
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_exr_has_no_facts() {
        assert!(facts(b"").is_empty());
        assert!(facts(&[0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0, 9, 9]).is_empty());
    }
}
