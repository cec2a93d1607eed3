"""Training, evaluation and analysis of policies; runs from the checkout, is not in the wheel."""
