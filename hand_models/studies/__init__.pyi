from .study import (
    STUDY_MODULES as STUDY_MODULES,
    Study as Study,
    as_json as as_json,
    load_study as load_study,
    run_study as run_study,
)
