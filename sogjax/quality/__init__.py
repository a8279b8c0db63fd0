"""Whether a motion can be trusted: evidence of limbs, confidence, verdict, errors against a truth (Section 6)."""
