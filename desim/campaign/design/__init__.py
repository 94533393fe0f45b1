"""What is asked: parameters, vectors, and the runs that they come to."""
