//! seaplant-report
