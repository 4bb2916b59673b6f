"""Whole heads of characters: a skin and up to 55 loose parts, carried from one person to another."""
