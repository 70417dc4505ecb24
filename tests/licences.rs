//! What the crate depends on: licences which everyone may use, and one `glam`.
//!
//! Asks `cargo tree` about the platform it runs on, for the packages of others may not be here.
//! `deny.toml` says the same of all platforms to those who have `cargo deny`.

use std::process::Command;

/// Licences of the default tree. All are permissive; none asks more than that notices are kept.
const ALLOWED: [&str; 6] = ["MIT", "Apache-2.0", "BSD-3-Clause", "Zlib", "BSL-1.0", "Unicode-3.0"];

/// Name, version and licence of every package of the default tree: with build dependencies, without
/// those of tests and benches (whose features `cargo metadata` would mix in).
fn default_tree() -> Vec<[String; 3]> {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--offline", "--locked", "--edges", "normal,build", "--prefix", "none"])
        .args(["--no-dedupe", "--format", "{p}\t{l}"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo runs this test");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let lines = String::from_utf8(output.stdout).expect("UTF-8");
    let mut packages: Vec<[String; 3]> = lines
        .lines()
        .map(|line| {
            let (package, licence) = line.split_once('\t').expect("the format asked for");
            let mut words = package.split(' ').map(str::to_owned);
            let mut word = || words.next().expect("name and version");
            [word(), word(), licence.to_owned()]
        })
        .collect();
    packages.sort();
    packages.dedup();
    assert!(packages.len() > 20, "only {} packages were found", packages.len());
    packages
}

/// Whether an SPDX expression can be met with the allowed licences: `OR` needs one side, `AND` both.
/// An exception (`WITH`) only permits more.
fn is_allowed(expression: &str) -> bool {
    // An old form of OR, which takes no part in the precedence of AND.
    let expression = expression.replace('/', " OR ").replace('(', " ( ").replace(')', " ) ");
    let mut words = expression.split_whitespace().peekable();
    let allowed = any_of(&mut words);
    assert!(words.next().is_none(), "not understood: {expression}");
    allowed
}

type Words<'a> = std::iter::Peekable<std::str::SplitWhitespace<'a>>;

fn any_of(words: &mut Words) -> bool {
    let mut allowed = all_of(words);
    while words.next_if_eq(&"OR").is_some() {
        allowed |= all_of(words);
    }
    allowed
}

fn all_of(words: &mut Words) -> bool {
    let mut allowed = single(words);
    while words.next_if_eq(&"AND").is_some() {
        allowed &= single(words);
    }
    allowed
}

fn single(words: &mut Words) -> bool {
    if words.next_if_eq(&"(").is_some() {
        let allowed = any_of(words);
        assert_eq!(words.next(), Some(")"));
        return allowed;
    }
    let allowed = words.next().is_some_and(|name| ALLOWED.contains(&name));
    if words.next_if_eq(&"WITH").is_some() {
        words.next();
    }
    allowed
}

#[test]
fn licence_expressions_are_read_with_and_before_or() {
    for good in [
        "MIT",
        "MIT OR GPL-3.0",
        "GPL-3.0/MIT",
        "Zlib AND (MIT OR GPL-2.0)",
        "GPL-2.0 AND MIT OR Zlib",
    ] {
        assert!(is_allowed(good), "{good}");
    }
    for wrong in ["GPL-3.0", "MIT AND GPL-3.0", "(GPL-2.0 OR LGPL-3.0) AND MIT", ""] {
        assert!(!is_allowed(wrong), "{wrong}");
    }
    assert!(is_allowed("GPL-2.0 OR Apache-2.0 WITH LLVM-exception"));
}

#[test]
fn every_dependency_has_a_licence_that_is_allowed() {
    for [name, version, licence] in default_tree() {
        assert!(is_allowed(&licence), "{name} {version}: {licence:?}");
    }
}

/// Two versions of its vectors would not fit together.
#[test]
fn there_is_one_glam() {
    let glams: Vec<_> = default_tree().into_iter().filter(|[name, ..]| name == "glam").collect();
    assert_eq!(glams.len(), 1, "{glams:?}");
}
