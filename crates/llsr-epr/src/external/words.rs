//! A command line taken apart.

/// Splits a command into words: at blanks, except within single or double quotes; a backslash takes the next character as it
/// is, within double quotes only before `"` and `\`, within single quotes never.
///
/// # Errors
/// What is wrong: a quote that is not closed, a backslash at the end, no word at all.
///
/// ```
/// let words = llsr_epr::split_words(r#"python3 'my shader.py' --name="a b" c\ d"#);
/// assert_eq!(words.unwrap(), ["python3", "my shader.py", "--name=a b", "c d"]);
/// ```
pub fn split_words(command: &str) -> Result<Vec<String>, String> {
    let mut words = Vec::new();
    // `None` between words.
    let mut word: Option<String> = None;
    let mut quote = None;
    let mut rest = command.chars().peekable();
    while let Some(next) = rest.next() {
        match (quote, next) {
            (Some(open), _) if next == open => quote = None,
            (Some('\''), _) => word.get_or_insert_default().push(next),
            (Some(_), '\\') => {
                let escaped = rest.next_if(|&c| c == '"' || c == '\\');
                word.get_or_insert_default().push(escaped.unwrap_or('\\'));
            }
            (Some(_), _) => word.get_or_insert_default().push(next),
            (None, '\'' | '"') => {
                quote = Some(next);
                word.get_or_insert_default();
            }
            (None, '\\') => match rest.next() {
                Some(escaped) => word.get_or_insert_default().push(escaped),
                None => return Err("the command ends with a backslash".to_owned()),
            },
            (None, _) if next.is_whitespace() => words.extend(word.take()),
            (None, _) => word.get_or_insert_default().push(next),
        }
    }
    if let Some(quote) = quote {
        return Err(format!("a quote {quote} is not closed in the command: {command}"));
    }
    words.extend(word);
    if words.first().is_none_or(String::is_empty) {
        return Err("the command is empty".to_owned());
    }
    Ok(words)
}

#[cfg(test)]
mod tests {
    use super::split_words;

    #[test]
    fn words_are_split_as_a_shell_does() {
        let cases: [(&str, &[&str]); 7] = [
            ("a b", &["a", "b"]),
            ("  a\t b  ", &["a", "b"]),
            ("'a b'c", &["a bc"]),
            ("a '' b", &["a", "", "b"]),
            (r#""a\"b\n""#, &["a\"b\\n"]),
            (r"'a\'b", &["a\\b"]),
            (r"a\'b\\", &["a'b\\"]),
        ];
        for (command, words) in cases {
            assert_eq!(split_words(command).expect(command), words, "{command}");
        }
        for bad in ["", "  ", "'a", "\"a", "a\\", "''"] {
            assert!(split_words(bad).is_err(), "{bad}");
        }
    }
}
