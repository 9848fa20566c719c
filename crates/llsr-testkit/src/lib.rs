//! Slow oracles, corpora and proptest strategies for the tests of the workspace.
