//! Values of a document by their path, for messages that say where a mistake is.

use serde_json::{Map, Value};

use crate::error::Error;

/// A place in a document, and the value there if it has one.
#[derive(Clone, Debug)]
pub(super) struct Element<'a> {
    value: Option<&'a Value>,
    path: String,
}

impl<'a> Element<'a> {
    /// A member of the document itself.
    pub(super) fn of(document: &'a Map<String, Value>, key: &str) -> Self {
        Self { value: document.get(key), path: key.to_owned() }
    }

    pub(super) fn path(&self) -> &str {
        &self.path
    }

    pub(super) fn is_present(&self) -> bool {
        self.value.is_some()
    }

    /// A member of an object.
    pub(super) fn get(&self, key: &str) -> Self {
        Self { value: self.value.and_then(|value| value.get(key)), path: format!("{}.{key}", self.path) }
    }

    /// The names of an object's members.
    pub(super) fn keys(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        self.value.and_then(Value::as_object).into_iter().flatten().map(|(key, _)| key.as_str())
    }

    /// How many elements an array has.
    pub(super) fn count(&self) -> usize {
        self.value.and_then(Value::as_array).map_or(0, Vec::len)
    }

    /// An element of an array, which must be an object.
    pub(super) fn at(&self, index: usize) -> Result<Self, Error> {
        let value = self.value.and_then(|value| value.get(index));
        match value {
            Some(Value::Object(_)) => Ok(Self { value, path: format!("{}[{index}]", self.path) }),
            Some(other) => Err(Error::damaged(format!("{}[{index}]: {other} is not an object", self.path))),
            None => Err(Error::damaged(format!("{}: there is no element {index}", self.path))),
        }
    }

    /// An element of an array, whatever it is.
    pub(super) fn element(&self, index: usize) -> Self {
        let value = self.value.and_then(|value| value.get(index));
        Self { value, path: format!("{}[{index}]", self.path) }
    }

    /// The error that nothing is here.
    pub(super) fn missing(&self) -> Error {
        Error::damaged(format!("{} is missing", self.path))
    }

    /// An array of `N` numbers; the default if there is no array.
    pub(super) fn row<const N: usize>(&self, default: [f64; N]) -> Result<[f64; N], Error> {
        if self.value.is_none() {
            return Ok(default);
        }
        self.check_count(N, "numbers")?;
        let mut row = [0.0; N];
        for (index, slot) in row.iter_mut().enumerate() {
            let element = self.element(index);
            let number = element.value.and_then(Value::as_f64);
            *slot = number.ok_or_else(|| element.is_not("a number"))?;
        }
        Ok(row)
    }

    /// An array of `ROWS` rows of `N` numbers.
    pub(super) fn rows<const N: usize, const ROWS: usize>(&self) -> Result<[[f64; N]; ROWS], Error> {
        if self.value.is_none() {
            return Err(self.missing());
        }
        self.check_count(ROWS, &format!("rows of {N} numbers"))?;
        let mut rows = [[0.0; N]; ROWS];
        for (index, row) in rows.iter_mut().enumerate() {
            *row = self.element(index).row([0.0; N])?;
        }
        Ok(rows)
    }

    fn check_count(&self, expected: usize, of: &str) -> Result<(), Error> {
        match self.value {
            Some(Value::Array(found)) if found.len() == expected => Ok(()),
            Some(Value::Array(found)) => {
                Err(Error::damaged(format!("{}: expected {expected} {of}, found {}", self.path, found.len())))
            }
            _ => Err(self.is_not(&format!("an array of {expected} {of}"))),
        }
    }

    /// A number in a range; the default if there is none.
    pub(super) fn number(&self, default: f64, range: brdf::Range) -> Result<f64, Error> {
        match self.value {
            None => Ok(default),
            Some(value) => number(value, range).ok_or_else(|| self.is_not(range.words)),
        }
    }

    /// The first three of three or four numbers in a range; the default if there is no array.
    pub(super) fn colour(&self, default: [f64; 3], range: brdf::Range) -> Result<[f64; 3], Error> {
        let Some(value) = self.value else { return Ok(default) };
        let channels: Option<Vec<f64>> = value
            .as_array()
            .and_then(|channels| channels.iter().map(|channel| number(channel, range)).collect());
        match channels.as_deref() {
            Some(&[red, green, blue] | &[red, green, blue, _]) => Ok([red, green, blue]),
            _ => Err(self.is_not(&format!("a colour, each channel {}", range.words))),
        }
    }

    /// Two numbers in a range; the default if there is no array.
    pub(super) fn pair(&self, default: [f64; 2], range: brdf::Range) -> Result<[f64; 2], Error> {
        let Some(value) = self.value else { return Ok(default) };
        match value.as_array().map(Vec::as_slice) {
            Some([one, other]) => number(one, range).zip(number(other, range)).map(<[f64; 2]>::from),
            _ => None,
        }
        .ok_or_else(|| self.is_not(&format!("two numbers, each {}", range.words)))
    }

    /// A count, an offset or an index, if there is one.
    pub(super) fn index(&self) -> Result<Option<usize>, Error> {
        let index = |value: &Value| value.as_u64().and_then(|index| usize::try_from(index).ok());
        self.value
            .map(|value| index(value).ok_or_else(|| self.is_not("a whole number from 0 on")))
            .transpose()
    }

    /// Whether there is a true value.
    pub(super) fn flag(&self) -> Result<bool, Error> {
        let flag = self.value.map(|value| value.as_bool().ok_or_else(|| self.is_not("true or false")));
        Ok(flag.transpose()?.unwrap_or(false))
    }

    /// A string, if there is one.
    pub(super) fn text(&self) -> Result<Option<&'a str>, Error> {
        self.value.map(|value| value.as_str().ok_or_else(|| self.is_not("a string"))).transpose()
    }

    fn is_not(&self, expected: &str) -> Error {
        // An array may hold anything.
        let found = match self.value {
            Some(Value::Array(_)) => "this array".to_owned(),
            Some(Value::Object(_)) => "this object".to_owned(),
            Some(value) => value.to_string(),
            None => "nothing".to_owned(),
        };
        Error::damaged(format!("{}: {found} is not {expected}", self.path))
    }
}

fn number(value: &Value, range: brdf::Range) -> Option<f64> {
    value.as_f64().filter(|number| (range.least..=range.most).contains(number))
}
