"""What stands for each of the two surfaces before they meet: prepared, with what was asked for."""
