"""What of a submission is an answer: notebooks and scripts in, cells for the sandbox out."""
