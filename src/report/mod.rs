//! What runs tell: JSON reports and the summaries on the terminal.
