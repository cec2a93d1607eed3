"""Studies: arms, seeds and where their runs are carried out."""
