"""Monte Carlo studies: experiments tried on a simulated true system, many times."""
