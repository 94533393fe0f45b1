"""Contacts of discs with matter."""
