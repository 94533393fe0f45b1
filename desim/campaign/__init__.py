"""Many runs to one question: the design, the runs that it asks for, and how they are run."""
