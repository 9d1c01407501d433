"""Find a model in a record alone: delays, orders and families, judged on data that they have not seen."""
