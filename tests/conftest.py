"""What all tests share: no example is judged by a clock, which a busy machine would decide."""

from hypothesis import settings

settings.register_profile(
    "kankaku", settings.get_profile(settings.get_current_profile_name()), deadline=None
)
settings.load_profile("kankaku")
