"""What the paper says of itself, quoted; nothing of it was measured here.

Times are those of its authors' implementation on a 3.5 GHz PC. Left out are the counts of its tables: its specimens are
not those of this project, and it does not state the eps of section 5.3 and 5.4.
"""

SEARCH_SECONDS_AT_100 = (2.0, 45.0)
BRUTE_FORCE_SECONDS = 3 * 3600.0

NOTE = (
    "Quoted from the paper, on its 3.5 GHz PC: Möbius search 2 to 45 s at N = 100; brute force 3 hours an instance.\n"
    "Not the same specimens and not the same eps (the paper does not state it for teeth and faces)."
)
