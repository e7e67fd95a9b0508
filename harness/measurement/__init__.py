"""One process per measurement: started, limited, ended, recorded."""
