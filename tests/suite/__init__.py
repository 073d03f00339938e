"""Questions with known answers: what `crux` said before, to be said again."""
