//! `manifest.json`: what was run, with what, and what came out.

use std::io::Read;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use super::{Input, RunOptions, file_error};
use crate::error::Error;

/// SHA-256 of a text as 64 hexadecimal digits.
pub fn sha256(bytes: &[u8]) -> String {
    in_hexadecimal(Sha256::digest(bytes).as_slice())
}

fn in_hexadecimal(digest: &[u8]) -> String {
    digest.iter().map(|b| format!("{b:02x}")).collect()
}

/// Size of a file and the SHA-256 of its content, read piece by piece.
///
/// # Errors
///
/// `Error::File` when it cannot be read.
pub fn size_and_hash(path: &Path) -> Result<(u64, String), Error> {
    let whole = || -> std::io::Result<(u64, String)> {
        let mut file = std::fs::File::open(path)?;
        let (mut hash, mut size) = (Sha256::new(), 0);
        let mut piece = vec![0; PIECE];
        loop {
            let count = file.read(&mut piece)?;
            if count == 0 {
                return Ok((size, in_hexadecimal(hash.finalize().as_slice())));
            }
            hash.update(&piece[..count]);
            size += count as u64;
        }
    };
    whole().map_err(|source| file_error("read", path, source))
}

/// Bytes read at once.
const PIECE: usize = 1 << 16;

/// The content of `manifest.json`: `program, version, model, inputs: [{name, size, sha256}], options,
/// files: [{name, size, sha256}]`. File names are relative to `out_dir`.
///
/// # Errors
///
/// `Error::File` when a written file cannot be read back.
pub fn value(out_dir: &Path, run: &RunOptions, files: &[PathBuf]) -> Result<Value, Error> {
    let mut list = Vec::new();
    for path in files {
        let (size, sha256) = size_and_hash(path)?;
        let name = path.strip_prefix(out_dir).unwrap_or(path);
        list.push(Input {
            name: name.to_string_lossy().into_owned(),
            size,
            sha256,
        });
    }
    Ok(json!({
        "program": env!("CARGO_PKG_NAME"),
        "version": env!("CARGO_PKG_VERSION"),
        "model": run.description,
        "inputs": run.inputs,
        "options": run.settings,
        "files": list,
    }))
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
