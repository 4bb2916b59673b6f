"""Collections as files: specimens in; tables, meshes, landmarks and a page of pictures out."""
