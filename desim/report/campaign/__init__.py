"""The report of a campaign: one page with figures and tables, made from the campaign's folder."""
