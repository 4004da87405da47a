//! `manifest.json`: what was run, with what, and what came out.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};
use sha2::{Digest, Sha256};

use crate::error::Error;

/// SHA-256 of a text or file as 64 hexadecimal digits.
pub fn sha256(bytes: &[u8]) -> String {
    let digest = Sha256::digest(bytes);
    digest.iter().map(|b| format!("{b:02x}")).collect()
}

/// The content of `manifest.json`: `program, version, inputs: [{name, size, sha256}], options,
/// files: [{name, size, sha256}]`. File names are relative to `out_dir`.
///
/// # Errors
///
/// `Error::File` when a written file cannot be read back.
pub fn value(
    out_dir: &Path,
    inputs: &[(String, Vec<u8>)],
    options: &Map<String, Value>,
    files: &[PathBuf],
) -> Result<Value, Error> {
    let mut list = Vec::new();
    for path in files {
        let bytes = std::fs::read(path).map_err(|source| Error::File {
            action: "read",
            path: path.clone(),
            source,
        })?;
        let name = path.strip_prefix(out_dir).unwrap_or(path);
        list.push(entry(&name.to_string_lossy(), &bytes));
    }
    let inputs: Vec<Value> = inputs.iter().map(|(name, b)| entry(name, b)).collect();
    Ok(json!({
        "program": env!("CARGO_PKG_NAME"),
        "version": env!("CARGO_PKG_VERSION"),
        "inputs": inputs,
        "options": options,
        "files": list,
    }))
}

fn entry(name: &str, bytes: &[u8]) -> Value {
    json!({"name": name, "size": bytes.len(), "sha256": sha256(bytes)})
}

#[cfg(test)]
mod tests {
    use super::sha256;

    #[test]
    fn sha256_of_abc() {
        // FIPS 180-2, appendix B.1.
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(sha256(b"abc"), expected);
    }
}
