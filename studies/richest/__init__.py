"""The richest manoeuvre: what the study of this name needs."""
