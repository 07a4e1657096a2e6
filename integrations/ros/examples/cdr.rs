//! Converts values of the interfaces between JSON and CDR, for comparison with other implementations. Each
//! input line is a JSON object and gets one line of output:
//!
//! - `{"type": "std_msgs/msg/Bool", "value": {"data": true}}` → `{"cdr": "0001000001"}`: little endian, with the
//!   header of four bytes
//! - `{"type": "std_msgs/msg/Bool", "cdr": "0001000001"}` → `{"value": {"data": true}}`
//! - `{"list": true}` → `{"types": [{"type": …, "rihs01": …, "structure": true}, …]}`
//!
//! `"variant": "lyrical"` selects the type of a distribution that differs. The output for an invalid request
//! is `{"error": …}`.

use std::io::BufRead;

use byteorder::LittleEndian;
use cdr_encoding::{from_bytes, to_vec};
use metaplan_ros::interfaces::Structure;
use serde::Deserialize;
use serde_json::{Value, json};

/// Encapsulation header of plain CDR, little endian.
const HEADER: [u8; 4] = [0, 1, 0, 0];

struct Codec {
    encode: fn(Value) -> Result<Vec<u8>, String>,
    decode: fn(&[u8]) -> Result<Value, String>,
}

/// A type with its hash; `codec` is `None` if the type has no structure in this package.
struct Entry {
    variant: Option<&'static str>,
    name: &'static str,
    rihs01: &'static str,
    codec: Option<Codec>,
}

impl Entry {
    const fn of<T: Structure>(variant: Option<&'static str>, name: &'static str) -> Self {
        let codec = Codec { encode: encode::<T>, decode: decode::<T> };
        Self { variant, name, rihs01: T::RIHS01, codec: Some(codec) }
    }

    const fn hash(variant: Option<&'static str>, name: &'static str, rihs01: &'static str) -> Self {
        Self { variant, name, rihs01, codec: None }
    }
}

static TABLE: &[Entry] = include!(concat!(env!("OUT_DIR"), "/table.rs"));

fn encode<T: Structure>(value: Value) -> Result<Vec<u8>, String> {
    let value: T = serde_json::from_value(value).map_err(|error| error.to_string())?;
    to_vec::<T, LittleEndian>(&value).map_err(|error| error.to_string())
}

fn decode<T: Structure>(bytes: &[u8]) -> Result<Value, String> {
    let (value, _) = from_bytes::<T, LittleEndian>(bytes).map_err(|error| error.to_string())?;
    serde_json::to_value(&value).map_err(|error| error.to_string())
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Request {
    #[serde(default)]
    list: bool,
    variant: Option<String>,
    r#type: Option<String>,
    value: Option<Value>,
    cdr: Option<String>,
}

fn bytes(hex: &str) -> Result<Vec<u8>, String> {
    let digits: Option<Vec<u8>> =
        hex.chars().map(|digit| digit.to_digit(16).and_then(|digit| u8::try_from(digit).ok())).collect();
    match digits {
        Some(digits) if digits.len() % 2 == 0 => {
            Ok(digits.chunks(2).map(|pair| pair[0] << 4 | pair[1]).collect())
        }
        _ => Err(format!("`{hex}` is not hexadecimal")),
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |text, byte| text + &format!("{byte:02x}"))
}

fn answer(line: &str) -> Result<Value, String> {
    let request: Request = serde_json::from_str(line).map_err(|error| error.to_string())?;
    if request.list {
        let types = TABLE.iter().map(|entry| {
            json!({
                "type": entry.name,
                "variant": entry.variant,
                "rihs01": entry.rihs01,
                "structure": entry.codec.is_some(),
            })
        });
        return Ok(json!({ "types": types.collect::<Vec<_>>() }));
    }
    let name = request.r#type.ok_or("`type` is missing")?;
    let is_it = |entry: &&Entry| entry.name == name && entry.variant == request.variant.as_deref();
    let codec = TABLE.iter().find(is_it).and_then(|entry| entry.codec.as_ref());
    let codec = codec.ok_or_else(|| format!("no structure `{name}`"))?;
    match (request.value, request.cdr) {
        (Some(value), None) => {
            let body = (codec.encode)(value)?;
            Ok(json!({ "cdr": hex(&[&HEADER[..], &body].concat()) }))
        }
        (None, Some(cdr)) => {
            let bytes = bytes(&cdr)?;
            let body =
                bytes.strip_prefix(&HEADER).ok_or("the header is not that of plain little endian CDR")?;
            Ok(json!({ "value": (codec.decode)(body)? }))
        }
        _ => Err("either `value` or `cdr`".to_owned()),
    }
}

#[allow(clippy::print_stdout, reason = "the answers")]
fn main() -> std::io::Result<()> {
    for line in std::io::stdin().lock().lines() {
        let answer = answer(&line?).unwrap_or_else(|error| json!({ "error": error }));
        println!("{answer}");
    }
    Ok(())
}
