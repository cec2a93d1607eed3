"""What a study found: statistics, figures and tables from its run folders."""
