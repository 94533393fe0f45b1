"""Many runs to one question: designs, the runs that they ask for, and how these are carried out."""
