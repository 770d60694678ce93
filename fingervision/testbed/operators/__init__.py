"""The person at the bed, who does what no motor does, and the terminal through which she is asked."""
