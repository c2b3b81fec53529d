"""Active contacts of the candidate pairs in every step: nodes on faces, edges on edges, nodes across cracks."""
