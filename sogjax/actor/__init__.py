"""From pictures of a subject to its actor: bone lengths, sizes and colours of the blobs (Section 5.2)."""
