"""A campaign's report: one page that a researcher reads first and copies from, its figures and its
tables. It is made of what lies in the campaign's folder, and changes nothing there.
"""
