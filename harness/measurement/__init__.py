"""One process per measurement: started, watched, ended, recorded."""
