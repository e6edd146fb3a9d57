"""Campaigns: a pure function of named pieces of work, done by processes of this machine or by a cluster."""
