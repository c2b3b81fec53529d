"""Bodies that meet: exposed faces, search, defence-node and edge-to-edge contact, ghosts of other ranks' surfaces."""
