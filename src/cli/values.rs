//! Parsers of option values: directories, settings, durations and times.

use std::path::PathBuf;

use num_rational::BigRational;
use serde_json::Value;

use crate::number::exact;

pub(super) use verify::seconds;

pub(super) fn existing_directory(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    if path.is_dir() { Ok(path) } else { Err(format!("there is no directory `{text}`")) }
}

pub(super) fn setting(text: &str) -> Result<(String, String), String> {
    let (name, value) =
        text.split_once('=').ok_or_else(|| format!("`{text}` is not of the form NAME=VALUE"))?;
    Ok((name.trim().to_owned(), value.trim().to_owned()))
}

pub(super) fn amount(text: &str) -> Result<(String, BigRational), String> {
    let (name, value) = setting(text)?;
    let wrong = || format!("`{value}` is not a decimal number");
    let number = serde_json::from_str::<Value>(&value).map_err(|_| wrong())?;
    Ok((name, decimal(&number).ok_or_else(wrong)?))
}

pub(super) fn time(text: &str) -> Result<BigRational, String> {
    let value = text.parse::<serde_json::Number>().ok().and_then(|number| decimal(&Value::Number(number)));
    value
        .filter(|value| *value >= BigRational::default())
        .ok_or_else(|| format!("`{text}` is not a time such as 0.001"))
}

pub(super) fn decimal(value: &Value) -> Option<BigRational> {
    exact(&value.as_number()?.to_string())
}
