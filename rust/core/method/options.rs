//! Options of methods, checked against their records before anything is built.

use super::MethodInfo;
use crate::error::{Error, Result};

/// The value of an option.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A word.
    Text(String),
    /// A number.
    Number(f64),
    /// Whole numbers.
    Integers(Vec<i64>),
    /// Numbers.
    Numbers(Vec<f64>),
    /// A word and a number.
    Named(String, f64),
    /// What no option can have, in words.
    Other(String),
}

/// An option in a record.
#[derive(Debug)]
pub struct OptionInfo {
    /// Name in calls.
    pub name: &'static str,
    /// What it may be, its default and what it does.
    pub doc: &'static str,
}

/// Options by name, as a caller gave them.
#[derive(Clone, Debug, Default)]
pub struct Options(pub Vec<(String, Value)>);

impl Options {
    /// Refuses what the record does not list.
    ///
    /// # Errors
    /// [`Error::UnknownOption`] naming the nearest.
    pub fn check(&self, info: &MethodInfo) -> Result<()> {
        for (name, _) in &self.0 {
            if info.options.iter().any(|option| option.name == name) {
                continue;
            }
            let names: Vec<_> = info.options.iter().map(|option| option.name).collect();
            let hint = match names.is_empty() {
                true => "it takes none".into(),
                false => format!(
                    "did you mean '{}'? (options: {})",
                    nearest(name, names.iter().copied()),
                    names.join(", ")
                ),
            };
            let message = format!("{}: unknown option '{name}'; {hint}", info.name);
            return Err(Box::new(Error::UnknownOption(message)));
        }
        Ok(())
    }

    /// The value of an option, if it was given.
    pub fn value(&self, name: &str) -> Option<&Value> {
        self.0.iter().find(|(given, _)| given == name).map(|(_, value)| value)
    }

    /// A word, if it was given.
    ///
    /// # Errors
    /// [`Error::Argument`] for another kind of value.
    pub fn text(&self, name: &str) -> Result<Option<&str>> {
        match self.value(name) {
            None => Ok(None),
            Some(Value::Text(text)) => Ok(Some(text)),
            Some(value) => Err(wrong(name, "a word", value)),
        }
    }

    /// A number, if it was given.
    ///
    /// # Errors
    /// [`Error::Argument`] for another kind of value.
    pub fn number(&self, name: &str) -> Result<Option<f64>> {
        match self.value(name) {
            None => Ok(None),
            Some(Value::Number(x)) => Ok(Some(*x)),
            Some(Value::Integers(x)) if x.len() == 1 => Ok(Some(x[0] as f64)),
            Some(value) => Err(wrong(name, "a number", value)),
        }
    }

    /// Numbers, if they were given.
    ///
    /// # Errors
    /// [`Error::Argument`] for another kind of value.
    pub fn numbers(&self, name: &str) -> Result<Option<&[f64]>> {
        match self.value(name) {
            None => Ok(None),
            Some(Value::Numbers(x)) => Ok(Some(x)),
            Some(value) => Err(wrong(name, "numbers", value)),
        }
    }

    /// A count, if it was given.
    ///
    /// # Errors
    /// [`Error::Argument`] for another kind of value or a negative one.
    pub fn count(&self, name: &str) -> Result<Option<usize>> {
        match self.value(name) {
            None => Ok(None),
            Some(Value::Integers(given)) if given.len() == 1 && given[0] >= 0 => {
                Ok(Some(given[0] as usize))
            }
            Some(value) => Err(wrong(name, "a count, 0 or more", value)),
        }
    }

    /// Counts, if they were given.
    ///
    /// # Errors
    /// [`Error::Argument`] for another kind of value or a negative one.
    pub fn counts(&self, name: &str) -> Result<Option<Vec<usize>>> {
        match self.value(name) {
            None => Ok(None),
            Some(Value::Integers(given)) if given.iter().all(|&x| x >= 0) => {
                Ok(Some(given.iter().map(|&x| x as usize).collect()))
            }
            Some(value) => Err(wrong(name, "a count, or a pair of counts", value)),
        }
    }
}

/// The error for a value of another kind.
pub fn wrong(name: &str, wanted: &str, got: &Value) -> Box<Error> {
    let got = match got {
        Value::Text(text) => format!("'{text}'"),
        Value::Number(x) => x.to_string(),
        Value::Integers(x) => match x[..] {
            [x] => x.to_string(),
            _ => format!("{x:?}"),
        },
        Value::Numbers(x) => format!("{x:?}"),
        Value::Named(word, x) => format!("('{word}', {x})"),
        Value::Other(words) => words.clone(),
    };
    Error::argument(format!("{name}: must be {wanted}, got {got}"))
}

/// The nearest of some names by the number of letters to change (Levenshtein).
pub fn nearest<'a>(name: &str, names: impl Iterator<Item = &'a str>) -> &'a str {
    names.min_by_key(|candidate| distance(name, candidate)).unwrap_or("")
}

fn distance(a: &str, b: &str) -> usize {
    let b: Vec<_> = b.chars().collect();
    let mut row: Vec<_> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut corner = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let change = corner + usize::from(x != *y);
            corner = row[j + 1];
            row[j + 1] = change.min(row[j] + 1).min(corner + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_found() {
        let names = ["correction", "doublings", "pade"];
        assert_eq!(nearest("corection", names.into_iter()), "correction");
        assert_eq!(nearest("doubling", names.into_iter()), "doublings");
        assert_eq!(distance("kitten", "sitting"), 3);
    }
}
