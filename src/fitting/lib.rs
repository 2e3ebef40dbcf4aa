//! What several stages share of the method: projection, shape operator, edge weights
