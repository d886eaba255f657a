//! A door that writes the results of inspections as files, and reads orders.
