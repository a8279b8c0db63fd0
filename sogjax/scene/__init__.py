"""What is known of the pictures: cells, quad-trees (Section 4.1), background, foreground and light."""
